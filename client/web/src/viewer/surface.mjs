/* Closest points of a mesh, found through a grid of its triangles. */
import * as THREE from 'three';

const ACROSS = 48, FARTHEST = 12; /* cells of the region's longest side; so many are looked through around a point */

const key = (i, j, k) => (i * 73856093) ^ (j * 19349663) ^ (k * 83492791);

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
        Object.assign(this, { positions: geometry.getAttribute('position'), index: geometry.index, cells: new Map(), region, cell: Math.max(...region.getSize(new THREE.Vector3()).toArray()) / ACROSS });
        const triangle = new THREE.Triangle(), box = new THREE.Box3();
        for (let t = 0; t < this.index.count; t += 3) {
            box.setFromPoints(this.#corners(t, triangle));
            if (region.intersectsBox(box)) this.#put(t, box);
        }
    }

    #cellOf(x) { return Math.floor(x / this.cell); }

    #corners(t, triangle) {
        const corners = [triangle.a, triangle.b, triangle.c];
        corners.forEach((corner, c) => corner.fromBufferAttribute(this.positions, this.index.getX(t + c)));
        return corners;
    }

    #put(t, box) {
        const { min, max } = box.intersect(this.region);
        for (let i = this.#cellOf(min.x); i <= this.#cellOf(max.x); i++)
            for (let j = this.#cellOf(min.y); j <= this.#cellOf(max.y); j++)
                for (let k = this.#cellOf(min.z); k <= this.#cellOf(max.z); k++) {
                    const at = key(i, j, k), held = this.cells.get(at);
                    if (held) held.push(t); else this.cells.set(at, [t]);
                }
    }

    /* The point of the surface that is closest to p; null where none is within a quarter of the region. */
    closest(p) {
        const middle = [p.x, p.y, p.z].map((x) => this.#cellOf(x)), triangle = new THREE.Triangle(), at = new THREE.Vector3(), found = new THREE.Vector3();
        let least = Infinity;
        for (let r = 0; r <= FARTHEST; r++) {
            for (const [i, j, k] of shell(r))
                for (const t of this.cells.get(key(middle[0] + i, middle[1] + j, middle[2] + k)) ?? []) {
                    this.#corners(t, triangle);
                    const d = triangle.closestPointToPoint(p, at).distanceTo(p);
                    if (d < least) { least = d; found.copy(at); }
                }
            if (least <= r * this.cell) break; /* farther cells are farther away than this */
        }
        return least < Infinity ? found : null;
    }
}
