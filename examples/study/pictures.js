// SPDX-License-Identifier: Apache-2.0
// Made by draw.
"use strict";
const PICTURES = [
  {"file": "pictures/01.png", "pose": "elbow", "view": "oblique", "method": "fem"},
  {"file": "pictures/02.png", "pose": "shoulder", "view": "oblique", "method": "fem"},
  {"file": "pictures/03.png", "pose": "knee", "view": "oblique", "method": "cor"},
  {"file": "pictures/04.png", "pose": "trunk", "view": "oblique", "method": "fem"},
  {"file": "pictures/05.png", "pose": "wrist", "view": "side", "method": "fem"},
  {"file": "pictures/06.png", "pose": "knee", "view": "side", "method": "cor"},
  {"file": "pictures/07.png", "pose": "hip", "view": "oblique", "method": "fem"},
  {"file": "pictures/08.png", "pose": "elbow", "view": "side", "method": "cor"},
  {"file": "pictures/09.png", "pose": "wrist", "view": "side", "method": "cor"},
  {"file": "pictures/10.png", "pose": "trunk", "view": "oblique", "method": "cor"},
  {"file": "pictures/11.png", "pose": "hip", "view": "oblique", "method": "cor"},
  {"file": "pictures/12.png", "pose": "shoulder", "view": "oblique", "method": "cor"},
  {"file": "pictures/13.png", "pose": "shoulder", "view": "side", "method": "cor"},
  {"file": "pictures/14.png", "pose": "hip", "view": "side", "method": "fem"},
  {"file": "pictures/15.png", "pose": "knee", "view": "oblique", "method": "fem"},
  {"file": "pictures/16.png", "pose": "elbow", "view": "oblique", "method": "cor"},
  {"file": "pictures/17.png", "pose": "hip", "view": "side", "method": "cor"},
  {"file": "pictures/18.png", "pose": "trunk", "view": "side", "method": "fem"},
  {"file": "pictures/19.png", "pose": "shoulder", "view": "side", "method": "fem"},
  {"file": "pictures/20.png", "pose": "elbow", "view": "side", "method": "fem"},
  {"file": "pictures/21.png", "pose": "knee", "view": "side", "method": "fem"},
  {"file": "pictures/22.png", "pose": "trunk", "view": "side", "method": "cor"},
];
