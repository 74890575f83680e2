// What the tests know of strand files: enough of Cem Yuksel HAIR to read it back and to compare.
import { readFileSync } from 'node:fs';

/** { n_strands, n_vertices, segments: Uint16Array, points: Float32Array } of a HAIR file. */
export function readHair(path) {
  const bytes = readFileSync(path);
  if (bytes.toString('latin1', 0, 4) !== 'HAIR') throw new Error(`${path} is no HAIR file`);
  const n_strands = bytes.readUInt32LE(4), n_vertices = bytes.readUInt32LE(8), arrays = bytes.readUInt32LE(12);
  const has_segments = arrays & 1, fixed = bytes.readUInt32LE(16);
  const segments = new Uint16Array(n_strands).fill(fixed);
  let at = 128;
  if (has_segments) for (let i = 0; i < n_strands; i++, at += 2) segments[i] = bytes.readUInt16LE(at);
  const points = new Float32Array(bytes.buffer.slice(bytes.byteOffset + at, bytes.byteOffset + at + 12 * n_vertices));
  return { n_strands, n_vertices, segments, points };
}

/** { minimum: [3], maximum: [3] }; throws where a number is not finite. */
export function box(points) {
  const minimum = [Infinity, Infinity, Infinity], maximum = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < points.length; i++) {
    if (!Number.isFinite(points[i])) throw new Error(`number ${i} is ${points[i]}`);
    minimum[i % 3] = Math.min(minimum[i % 3], points[i]);
    maximum[i % 3] = Math.max(maximum[i % 3], points[i]);
  }
  return { minimum, maximum };
}

/** HAIR bytes of straight strands of unit length, for tests that need any file. */
export function straightHair(n_strands, n_vertices = 5) {
  const bytes = Buffer.alloc(128 + 12 * n_strands * n_vertices);
  bytes.write('HAIR', 0, 'latin1');
  bytes.writeUInt32LE(n_strands, 4);
  bytes.writeUInt32LE(n_strands * n_vertices, 8);
  bytes.writeUInt32LE(2, 12); // points alone
  bytes.writeUInt32LE(n_vertices - 1, 16);
  const side = Math.ceil(Math.sqrt(n_strands));
  for (let i = 0, at = 128; i < n_strands; i++)
    for (let j = 0; j < n_vertices; j++, at += 12) {
      bytes.writeFloatLE(0.1 * (i % side) / side, at);
      bytes.writeFloatLE(0.2 * j / (n_vertices - 1), at + 4);
      bytes.writeFloatLE(0.1 * Math.floor(i / side) / side, at + 8);
    }
  return bytes;
}
