/* Strands and heads as the daemon has them, ready to be shown. */
import { BufferGeometry, Float32BufferAttribute } from 'three';
import { OBJLoader } from 'three/addons/loaders/OBJLoader.js';
import { mergeVertices } from 'three/addons/utils/BufferGeometryUtils.js';
import { PLYLoader } from 'three/addons/loaders/PLYLoader.js';
import { bytesOf } from '../engine/engine.mjs';
import { bytes, get } from './api.mjs';

/* USC .data -> { points, count, vertices } with a Hair's room at the ends. Strand i of the file stands at
 * slotOf[i] where that is given; what has fewer vertices than the longest rests at its tip. */
function parse(buffer, slotOf) {
    const view = new DataView(buffer), count = view.getInt32(0, true), begins = new Uint32Array(count + 1);
    let vertices = 2;
    for (let s = 0, at = 4; s < count; s++) {
        begins[s] = at + 4;
        vertices = Math.max(vertices, view.getInt32(at, true));
        at = begins[s + 1] = begins[s] + 12 * view.getInt32(at, true);
    }
    const points = new Float32Array(3 + 3 * count * vertices + 6);
    for (let s = 0; s < count; s++) {
        const own = new Float32Array(buffer, begins[s], 3 * view.getInt32(begins[s] - 4, true)), to = 3 + 3 * (slotOf ? slotOf[s] : s) * vertices;
        points.set(own, to);
        for (let i = own.length; i < 3 * vertices; i++) points[to + i] = own[own.length - 3 + (i % 3)];
    }
    return { points, count, vertices };
}

/* A groom's strands as the daemon evaluates them. */
export const fetchGroomStrands = async (at, revision, count, slotOf) =>
    parse(await bytes(`${at}/strands?format=data&revision=${revision}&count=${count}`), slotOf);

/* So many of an upload's strands, evenly resampled. */
export const fetchStrands = async (id, count, vertices, slotOf) =>
    parse(await bytes(`/v1/strands/${id}/data?format=data&count=${count}&vertices=${vertices}`), slotOf);

/* (x, y, z) with z up is (x, z, -y) here. */
function intoMetres(positions, unit_m, up) {
    for (let i = 0; i < positions.length; i += 3) {
        const [x, y, z] = [positions[i] * unit_m, positions[i + 1] * unit_m, positions[i + 2] * unit_m];
        positions[i] = x;
        positions[i + 1] = up === 'z' ? z : y;
        positions[i + 2] = up === 'z' ? -y : z;
    }
}

function geometryOf(format, buffer) {
    if (format === 'ply') return new PLYLoader().parse(buffer);
    const parts = [];
    new OBJLoader().parse(new TextDecoder().decode(buffer)).traverse((part) => part.isMesh && parts.push(part.geometry.getAttribute('position').array));
    const positions = new Float32Array(parts.reduce((n, part) => n + part.length, 0));
    parts.reduce((at, part) => { positions.set(part, at); return at + part.length; }, 0);
    return new BufferGeometry().setAttribute('position', new Float32BufferAttribute(positions, 3));
}

export async function fetchHead(id) {
    const [{ format, unit_m, up }, buffer] = await Promise.all([get(`/v1/heads/${id}`), bytes(`/v1/heads/${id}/data`)]);
    const geometry = geometryOf(format, buffer);
    intoMetres(geometry.getAttribute('position').array, unit_m, up);
    for (const name of Object.keys(geometry.attributes)) if (name !== 'position') geometry.deleteAttribute(name);
    return mergeVertices(geometry, 1e-6); /* triangles of a file share corners: smooth normals need them to */
}

/* An array of a document: { dtype, shape, data }. */
export function arrayOf(array) {
    const { buffer } = bytesOf(array);
    return array.dtype === 'u32' ? new Uint32Array(buffer) : new Float32Array(buffer);
}
