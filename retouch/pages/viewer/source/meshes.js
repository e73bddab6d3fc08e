// Meshes of a page: decoding the arrays that `packing.py` writes, and geometry for the graphics card.
import { BufferAttribute, BufferGeometry } from "three";

const CREASE = Math.cos((75 * Math.PI) / 180);
const KINDS = { uint8: Uint8Array, uint16: Uint16Array, uint32: Uint32Array };

/** Values of one array: base64 of zlib of byte planes of differences along the rows. */
async function unpacked({ data, kind, columns }) {
  const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
  const inflated = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(inflated).arrayBuffer());
  const values = new KINDS[kind](planes.length / KINDS[kind].BYTES_PER_ELEMENT);
  const count = values.length;
  for (let plane = 0; plane * count < planes.length; plane += 1)
    for (let k = 0; k < count; k += 1) values[k] |= planes[plane * count + k] << (8 * plane);
  for (let k = columns; k < count; k += 1) values[k] += values[k - columns];
  return values;
}

/** Faces around each vertex: `faces[k]` for k from `start[vertex]` to `start[vertex + 1]`. */
function around(corners, count) {
  const start = new Uint32Array(count + 1);
  for (const corner of corners) start[corner + 1] += 1;
  for (let k = 0; k < count; k += 1) start[k + 1] += start[k];
  const next = start.slice(), faces = new Uint32Array(corners.length);
  corners.forEach((corner, k) => { faces[next[corner]++] = (k / 3) | 0; });
  return { start, faces };
}

/** Normals of the corners, smooth but for creases: means of the faces around that turn less than CREASE. */
function cornerNormals(places, corners, count) {
  const faceCount = corners.length / 3, normal = new Float32Array(corners.length), unit = new Float32Array(corners.length);
  for (let f = 0; f < faceCount; f += 1) {
    const [a, b, c] = [3 * corners[3 * f], 3 * corners[3 * f + 1], 3 * corners[3 * f + 2]];
    const ux = places[b] - places[a], uy = places[b + 1] - places[a + 1], uz = places[b + 2] - places[a + 2];
    const vx = places[c] - places[a], vy = places[c + 1] - places[a + 1], vz = places[c + 2] - places[a + 2];
    const n = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    const length = Math.hypot(...n) || 1;
    for (let k = 0; k < 3; k += 1) { normal[3 * f + k] = n[k]; unit[3 * f + k] = n[k] / length; }
  }
  const { start, faces } = around(corners, count), result = new Float32Array(3 * corners.length);
  for (let k = 0; k < corners.length; k += 1) {
    const own = 3 * ((k / 3) | 0);
    let x = 0, y = 0, z = 0;
    for (let j = start[corners[k]]; j < start[corners[k] + 1]; j += 1) {
      const other = 3 * faces[j];
      const cosine = unit[own] * unit[other] + unit[own + 1] * unit[other + 1] + unit[own + 2] * unit[other + 2];
      if (cosine < CREASE) continue;
      x += normal[other]; y += normal[other + 1]; z += normal[other + 2];
    }
    const length = Math.hypot(x, y, z) || 1;
    result.set([x / length, y / length, z / length], 3 * k);
  }
  return result;
}

/** Colours of sRGB bytes as linear 16-bit values, for each corner. */
function cornerColours(colours, corners) {
  const linear = Uint16Array.from({ length: 256 }, (_, k) => {
    const s = k / 255;
    return Math.round(65535 * (s <= 0.04045 ? s / 12.92 : ((s + 0.055) / 1.055) ** 2.4));
  });
  const result = new Uint16Array(3 * corners.length);
  for (let k = 0; k < corners.length; k += 1)
    for (let c = 0; c < 3; c += 1) result[3 * k + c] = linear[colours[3 * corners[k] + c]];
  return new BufferAttribute(result, 3, true);
}

/** The geometry of a mesh with its layers of colour, and its places in mm. */
export async function loaded(mesh, shared) {
  const steps = await unpacked(mesh.positions);
  const places = Float32Array.from(steps, (value, k) => mesh.low[k % 3] + mesh.step * value);
  const corners = mesh.faces ? await unpacked(mesh.faces) : shared.corners;
  const spread = new Float32Array(3 * corners.length);
  for (let k = 0; k < corners.length; k += 1)
    for (let c = 0; c < 3; c += 1) spread[3 * k + c] = places[3 * corners[k] + c];
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(spread, 3));
  geometry.setAttribute("normal", new BufferAttribute(cornerNormals(places, corners, places.length / 3), 3));
  const layers = new Map();
  for (const { name, colours } of mesh.layers) layers.set(name, cornerColours(await unpacked(colours), corners));
  return { name: mesh.name, geometry, places, corners, layers };
}
