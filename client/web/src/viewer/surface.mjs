/* Closest points of a mesh, found through a grid of its triangles. */
import * as THREE from 'three';

const CELL_M = 0.01, FARTHEST = 12; /* cells that are looked through around a point */

const key = (i, j, k) => (i * 73856093) ^ (j * 19349663) ^ (k * 83492791);
const cellOf = (x) => Math.floor(x / CELL_M);

/* Cells whose largest step from the middle is r. */
function* shell(r) {
    for (let i = -r; i <= r; i++)
        for (let j = -r; j <= r; j++)
            for (let k = -r, step = Math.max(Math.abs(i), Math.abs(j)) === r ? 1 : 2 * r; k <= r; k += step) yield [i, j, k];
}

export class Surface {
    /* geometry  with an index, borrowed as long as this lives
     * region    what is asked for lies in this box; triangles outside are left out */
    constructor(geometry, region) {
        Object.assign(this, { positions: geometry.getAttribute('position'), index: geometry.index, cells: new Map() });
        const triangle = new THREE.Triangle(), box = new THREE.Box3();
        for (let t = 0; t < this.index.count; t += 3) {
            box.setFromPoints(this.#corners(t, triangle));
            if (region.intersectsBox(box)) this.#put(t, box);
        }
    }

    #corners(t, triangle) {
        const corners = [triangle.a, triangle.b, triangle.c];
        corners.forEach((corner, c) => corner.fromBufferAttribute(this.positions, this.index.getX(t + c)));
        return corners;
    }

    #put(t, { min, max }) {
        for (let i = cellOf(min.x); i <= cellOf(max.x); i++)
            for (let j = cellOf(min.y); j <= cellOf(max.y); j++)
                for (let k = cellOf(min.z); k <= cellOf(max.z); k++) {
                    const at = key(i, j, k), held = this.cells.get(at);
                    if (held) held.push(t); else this.cells.set(at, [t]);
                }
    }

    /* The point of the surface that is closest to p; null where none is within some 0.1 m. */
    closest(p) {
        const middle = [cellOf(p.x), cellOf(p.y), cellOf(p.z)], triangle = new THREE.Triangle(), at = new THREE.Vector3(), found = new THREE.Vector3();
        let least = Infinity;
        for (let r = 0; r <= FARTHEST; r++) {
            for (const [i, j, k] of shell(r))
                for (const t of this.cells.get(key(middle[0] + i, middle[1] + j, middle[2] + k)) ?? []) {
                    this.#corners(t, triangle);
                    const d = triangle.closestPointToPoint(p, at).distanceTo(p);
                    if (d < least) { least = d; found.copy(at); }
                }
            if (least <= r * CELL_M) break; /* farther cells are farther away than this */
        }
        return least < Infinity ? found : null;
    }
}
