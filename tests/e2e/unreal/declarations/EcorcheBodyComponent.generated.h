// SPDX-License-Identifier: Apache-2.0
// Made by Unreal of the header of the same name.
#pragma once
