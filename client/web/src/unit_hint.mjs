/* A wrong unit shows in the size: hair is not 30 metres across. The same ranges and guess as groomctl's
 * (client/groomctl/unit_hint.c). */
export const UNITS = { m: 'metres', cm: 'centimetres', mm: 'millimetres', dm: 'decimetres', in: 'inches' };
const METRES = { m: 1, cm: 0.01, mm: 0.001, dm: 0.1, in: 0.0254 }, RARITY = { dm: 2, in: 2 };

/* Metres across: what is taken as it is, and what is most likely. */
const RANGES = {
    hair: { least: 0.04, likely: 0.4, most: 2.5 },
    mesh: { least: 0.12, likely: 0.6, most: 2.6 },
};

/* What to say of an upload, { id, bbox, unit_m } as the server answers; nothing where its size can be. */
export function unitHint({ id, bbox, unit_m }) {
    const what = id.startsWith('head_') ? 'mesh' : 'hair', { least, likely, most } = RANGES[what];
    const size = Math.max(...bbox.max.map((high, k) => high - bbox.min[k])), own = size / unit_m;
    if (size >= least && size <= most) return '';
    const off = (unit) => Math.abs(Math.log(own * METRES[unit] / likely)) + Math.log(RARITY[unit] ?? 1);
    const [guess] = Object.keys(METRES).filter((unit) => own * METRES[unit] >= least && own * METRES[unit] <= most).sort((a, b) => off(a) - off(b));
    const is = ` The ${what} is ${size.toPrecision(3)} m across in the unit given`;
    return guess ? `${is}; in ${UNITS[guess]} it would be ${(own * METRES[guess]).toPrecision(3)} m. If that is meant, choose ${UNITS[guess]} and upload it again.`
        : `${is}; hair is 0.2 to 0.8 m. Is it right?`;
}
