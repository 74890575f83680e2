/* Taking it home: what, in which format and unit, and the same as a line for a shell. */
import { tell } from '../commands.mjs';
import { element, whole } from '../dom.mjs';
import { lines } from './commands.mjs';

const WHAT = { strands: 'dense strands', guides: 'guides', document: 'groom document (JSON)' };
const FORMATS = { usda: 'USD curves (Unreal, Houdini, Maya)', hair: 'HAIR (Cem Yuksel)', ply: 'PLY', obj: 'OBJ polylines (Blender)', data: 'USC .data', json: 'JSON points' };
const UNITS = { m: 'metres', cm: 'centimetres', mm: 'millimetres', dm: 'decimetres', in: 'inches' };
/* About as many bytes a vertex takes. */
const BYTES = { usda: 32, hair: 12, ply: 14, obj: 38, data: 12, json: 34 };

export const pick = (label, name, options, chosen) => element('label', {}, label,
    element('select', { name }, Object.entries(options).map(([value, text]) => element('option', { value, selected: value === chosen }, text))));

/* After the groom; grooms are often named after the file that they were fitted to. */
const stem = ({ document, id }) => (document.name || id).replace(/\.(hair|data|ply|obj|tfx|np[yz]|json|bin)$/i, '').replaceAll(/[^\w.-]+/g, '_');
export const fileName = (session, ending) => `${stem(session)}.${ending}`;

const megabytes = (n) => (n < 1e6 ? `${Math.max(1, Math.round(n / 1e3))} KB` : `${(n / 1e6).toPrecision(2)} MB`);

/* How much it will be. */
function sizeOf({ document }, { what, format, count }) {
    if (what === 'document') return '';
    const strands = what === 'guides' ? document.guides?.count ?? 0 : Number(count) || document.strands.count;
    return `${whole(strands)} × ${document.strands.vertices} vertices, about ${megabytes(strands * document.strands.vertices * BYTES[format])}`;
}

export function exportPanel(parent, session) {
    const total = session.document.strands.count;
    const form = element('form', { class: 'panel', 'aria-label': 'Export', onsubmit: (event) => event.preventDefault() }, element('h2', {}, 'Export'),
        pick('what', 'what', WHAT), pick('format', 'format', FORMATS), pick('unit', 'unit', UNITS, 'cm'),
        pick('up axis', 'up', { y: 'y up', z: 'z up' }),
        element('label', {}, 'strands', element('input', { name: 'count', type: 'number', min: 1, max: total, placeholder: `all ${total}`, title: 'Fewer are a fair sample of all' })));
    const size = element('p', { class: 'hint' }), both = lines();
    const link = element('a', { class: 'button', download: true, onclick: () => tell(call()) }, 'Download');
    const [ctl, curl] = both.rows;
    form.append(size, link, curl, ctl);
    const call = () => {
        const { what, format, unit, up, count } = { ...Object.fromEntries(new FormData(form)), what: form.elements.what.value };
        const file = fileName(session, what === 'document' ? 'groom.json' : what === 'guides' ? `guides.${format}` : format);
        const query = new URLSearchParams({ format, unit, up, revision: session.revision });
        if (count && what === 'strands') query.set('count', count);
        return { method: 'GET', file, path: what === 'document' ? `${session.at}?revision=${session.revision}` : `${session.at}/${what}?${query}` };
    };
    const refresh = () => {
        const what = form.elements.what.value;
        for (const name of ['format', 'unit', 'up']) form.elements[name].disabled = false;
        const now = call();
        Object.assign(link, { href: now.path, download: now.file });
        both.say(now);
        size.textContent = sizeOf(session, { what, format: form.elements.format.value, count: form.elements.count.value });
        for (const name of ['format', 'unit', 'up']) form.elements[name].disabled = what === 'document';
        form.elements.count.disabled = what !== 'strands';
    };
    if (!session.document.guides) form.elements.what.querySelector('[value=guides]').remove(); /* a groom on strands of an upload */
    form.addEventListener('input', refresh);
    session.addEventListener('revision', refresh);
    refresh();
    parent.append(form);
}
