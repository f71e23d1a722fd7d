// SPDX-License-Identifier: Apache-2.0
#pragma once

class FDefaultModuleImpl {};
#define IMPLEMENT_MODULE(kind, name) kind UnrealModule##name;
