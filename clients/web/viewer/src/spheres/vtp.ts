// SPDX-License-Identifier: Apache-2.0
// A volumetric skeleton as the file that `ecorche thin` writes and `ecorche refill` reads: the twin of
// io/surface/volumetric_skeleton_writer.cpp. See docs/reference/volumetric.md, "The file".
import type { Spheres } from "../../../protocol/src/index.js";

type Values = Uint16Array | Uint32Array | Float32Array | Int32Array;

/** As the shortest decimal number that reads back the same. */
const numbers = (type: string, name: string, values: ArrayLike<number>) =>
  `<DataArray type="${type}" Name="${name}" NumberOfTuples="${values.length}" format="ascii">${Array.from(values, (value) => `${value} `).join("")}</DataArray>\n`;

/** Bytes of every letter, 0 behind each word. */
const strings = (name: string, values: readonly string[]) =>
  `<Array type="String" Name="${name}" NumberOfTuples="${values.length}" format="ascii">${values.map((value) => `${[...new TextEncoder().encode(value), 0].join(" ")} `).join("")}</Array>\n`;

/** Arrays as their tags, and their bytes behind the XML, each after its length. */
class Appended {
  readonly parts: BlobPart[] = [];
  #offset = 0;

  tag(type: string, name: string, components: number, values: Values): string {
    const length = new BigUint64Array([BigInt(values.byteLength)]), offset = this.#offset;
    this.parts.push(length, values as Values & ArrayBufferView<ArrayBuffer>);
    this.#offset += length.byteLength + values.byteLength;
    return `<DataArray type="${type}" Name="${name}" NumberOfComponents="${components}" format="appended" offset="${offset}"/>\n`;
  }
}

/** mm, LPS, 3 for each ball. */
export function placesOf({ grid: { origin, spacing, direction }, voxels }: Pick<Spheres, "grid" | "voxels">): Float32Array<ArrayBuffer> {
  const places = new Float32Array(voxels.length);
  for (let at = 0; at < voxels.length; at += 3) {
    for (let row = 0; row < 3; ++row) {
      let sum = origin[row]!;
      for (let axis = 0; axis < 3; ++axis) sum += direction[3 * row + axis]! * spacing[axis]! * voxels[at + axis]!;
      places[at + row] = sum;
    }
  }
  return places;
}

/** `segments`: their names, by row. `joints`: only where they were moved. */
export function writeVtp(spheres: Spheres, segments: readonly string[], joints: Float64Array | null): Blob {
  const { grid, voxels, distance, deficit, parent, segment } = spheres, count = distance.length, appended = new Appended();
  const edges = parent ? Array.from(parent.keys()).filter((row) => parent[row]! >= 0) : [];
  const corners = Int32Array.from(edges.flatMap((row) => [row, parent![row]!])), ends = Int32Array.from(edges, (_, at) => 2 * at + 2);
  const xml = [
    '<?xml version="1.0"?>\n<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">\n<PolyData>\n<FieldData>\n',
    numbers("Int32", "ecorche_volumetric_skeleton", [1]), strings("name", [spheres.name]), strings("SPACE", ["LPS"]),
    numbers("Int32", "size", grid.size), numbers("Float64", "origin", grid.origin), numbers("Float64", "spacing", grid.spacing), numbers("Float64", "direction", grid.direction),
    strings("metric", [spheres.metric]), numbers("Float64", "thinness", [spheres.thinness]), numbers("UInt8", "tree", [parent ? 1 : 0]), strings("segments", segments),
    joints ? numbers("Float64", "joints", joints) : "",
    `</FieldData>\n<Piece NumberOfPoints="${count}" NumberOfVerts="0" NumberOfLines="${ends.length}" NumberOfStrips="0" NumberOfPolys="0">\n<PointData Scalars="deficit">\n`,
    appended.tag("UInt16", "ijk", 3, voxels), appended.tag("UInt32", "distance", 1, distance), appended.tag("Float32", "deficit", 1, deficit), appended.tag("Int32", "segment", 1, segment),
    "</PointData>\n<Points>\n", appended.tag("Float32", "Points", 3, placesOf(spheres)), "</Points>\n<Lines>\n",
    appended.tag("Int32", "connectivity", 1, corners), appended.tag("Int32", "offsets", 1, ends), '</Lines>\n</Piece>\n</PolyData>\n<AppendedData encoding="raw">\n_',
  ].join("");
  return new Blob([xml, ...appended.parts, "\n</AppendedData>\n</VTKFile>\n"], { type: "model/vnd.vtp" });
}
