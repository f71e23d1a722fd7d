# SPDX-License-Identifier: Apache-2.0
"""BVH and ASF/AMC files read by other means than ecorche's: where the joints of a figure are, frame by frame. LPS, file units."""
import re

import numpy as np

TO_LPS = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], float)  # from x Left, y Superior, z Anterior


def about(axis, degrees):
    a, b = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis.lower()]
    out, angle = np.eye(3), np.radians(degrees)
    out[a, a] = out[b, b] = np.cos(angle)
    out[b, a], out[a, b] = np.sin(angle), -np.sin(angle)
    return out


class Bvh:
    def __init__(self, path):
        words = path.read_text().split()
        self.names, self.parent, self.offset, self.channels = [], [], [], []
        stack, i = [], 0
        while words[i] != "MOTION":
            if words[i] in ("ROOT", "JOINT", "End"):
                self.names.append(words[i + 1] if words[i] != "End" else f"end of {self.names[stack[-1]]}")
                self.parent.append(stack[-1] if stack else -1)
                self.channels.append([])
                i += 1
            elif words[i] == "{":
                stack.append(len(self.names) - 1)
            elif words[i] == "}":
                stack.pop()
            elif words[i] == "OFFSET":
                self.offset.append(np.array(words[i + 1:i + 4], float))
            elif words[i] == "CHANNELS":
                self.channels[-1] = words[i + 2:i + 2 + int(words[i + 1])]
            i += 1
        self.seconds = float(words[i + 5])
        self.rows = np.array(words[i + 6:], float).reshape(int(words[i + 2]), -1)

    def frames(self):
        return len(self.rows)

    def at(self, frame):
        """(places, rows of parents) by name."""
        values, turns, places = iter(self.rows[frame]), [], []
        for j, parent in enumerate(self.parent):
            turn, place = np.eye(3), self.offset[j].copy()
            for channel in self.channels[j]:
                value = next(values)
                if channel.endswith("rotation"):
                    turn = turn @ about(channel[0], value)
                elif parent < 0:
                    place["XYZ".index(channel[0])] = value
            turns.append(turn if parent < 0 else turns[parent] @ turn)
            places.append(place if parent < 0 else places[parent] + turns[parent] @ place)
        return dict(zip(self.names, np.array(places) @ TO_LPS.T)), self.parent


class Amc:
    def __init__(self, path):
        asf = path.with_name(path.name.split("_")[0] + ".asf").read_text()
        self.bones = {}
        for text in re.findall(r"begin\s+id(.*?)end", asf, re.S):
            words = {line.split()[0]: line.split()[1:] for line in text.splitlines()[1:] if line.split()}
            self.bones[words["name"][0]] = {"way": float(words["length"][0]) * np.array(words["direction"][:3], float),
                                            "axis": [float(x) for x in words["axis"][:3]], "dof": words.get("dof", [])}
        self.above = {}
        for line in asf.split(":hierarchy")[1].splitlines():
            names = line.split()
            self.above.update({name: names[0] for name in names[1:]} if len(names) > 1 else {})
        self.names = ["root", *self.above]
        self.parent = [-1] + [self.names.index(self.above[name]) for name in self.names[1:]]
        self.seconds, self.rows = 1 / 120, []
        for line in path.read_text().splitlines():
            words = line.split()
            if len(words) == 1 and words[0].isdigit():
                self.rows.append({})
            elif self.rows and words:
                self.rows[-1][words[0]] = [float(x) for x in words[1:]]

    def frames(self):
        return len(self.rows)

    def at(self, frame):
        row = self.rows[frame]
        turns, begin, end = {}, {}, {}
        for name in self.names:
            if name == "root":
                x, y, z = row["root"][3:]
                turns[name] = about("z", z) @ about("y", y) @ about("x", x)
                begin[name] = end[name] = np.array(row["root"][:3])
                continue
            bone, parent = self.bones[name], self.above[name]
            frame_of = about("z", bone["axis"][2]) @ about("y", bone["axis"][1]) @ about("x", bone["axis"][0])
            moved = np.eye(3)
            for dof, value in zip(bone["dof"], row.get(name, [])):
                moved = about(dof[1], value) @ moved
            turns[name] = turns[parent] @ frame_of @ moved @ frame_of.T
            begin[name] = end[parent]
            end[name] = begin[name] + turns[name] @ bone["way"]
        return {name: TO_LPS @ begin[name] for name in self.names}, self.parent


def read(path):
    return Amc(path) if path.suffix == ".amc" else Bvh(path)


# Limb: its ends in each style; {} stands for the side, long and as a letter.
STYLES = {"cmu_31joint": "{S}Arm {S}ForeArm {S}Hand {S}UpLeg {S}Leg {S}Foot", "cmu_asf_amc": "{l}humerus {l}radius {l}wrist {l}femur {l}tibia {l}foot",
          "cmu_cc3_100joint": "CC_Base_{L}_Upperarm CC_Base_{L}_Forearm CC_Base_{L}_Hand CC_Base_{L}_Thigh CC_Base_{L}_Calf CC_Base_{L}_Foot"}


def limbs(style, places):
    """Unit directions of arms and legs, {name: vector}."""
    out = {}
    for side in ("left", "right"):
        at = [places[name] for name in STYLES[style].format(S=side.capitalize(), l=side[0], L=side[0].upper()).split()]
        for name, a, b in (("upper_arm", 0, 1), ("forearm", 1, 2), ("thigh", 3, 4), ("shank", 4, 5)):
            way = at[b] - at[a]
            out[f"{name}_{side}"] = way / np.linalg.norm(way)
    return out
