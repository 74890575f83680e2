/* Taking it home: what, in which format and unit, and the same as a line for a shell. */
import { element } from '../dom.mjs';

const FORMATS = { usda: 'USD curves (Unreal, Houdini, Maya)', hair: 'HAIR (Cem Yuksel)', ply: 'PLY', obj: 'OBJ polylines (Blender)', data: 'USC .data', json: 'JSON points' };

const pick = (label, name, options, chosen) => element('label', {}, label,
    element('select', { name }, Object.entries(options).map(([value, text]) => element('option', { value, selected: value === chosen }, text))));

const copyable = (label) => {
    const text = element('code', {});
    const button = element('button', { type: 'button', 'aria-label': `Copy the ${label} line`, onclick: () => navigator.clipboard?.writeText(text.textContent) }, 'copy');
    return { text, row: element('p', { class: 'line' }, button, text) };
};

export function exportPanel(parent, session) {
    const form = element('form', { class: 'panel' }, element('h2', {}, 'Export'),
        pick('what', 'what', { strands: 'dense strands', guides: 'guides', document: 'groom document (JSON)' }),
        pick('format', 'format', FORMATS), pick('unit', 'unit', { m: 'metres', cm: 'centimetres', mm: 'millimetres', in: 'inches' }, 'cm'),
        pick('up axis', 'up', { y: 'y up', z: 'z up' }),
        element('label', {}, 'strands', element('input', { name: 'count', type: 'number', min: 1, max: session.document.strands.count, placeholder: `all ${session.document.strands.count}` })));
    const link = element('a', { class: 'button', download: true }, 'Download'), curl = copyable('curl'), ctl = copyable('groomctl');
    form.append(link, curl.row, ctl.row);
    const tell = () => {
        const { what, format, unit, up, count } = Object.fromEntries(new FormData(form));
        const file = `${(session.document.name || session.id).replaceAll(/[^\w.-]+/g, '_')}.${what === 'document' ? 'groom.json' : format}`;
        const query = new URLSearchParams({ format, unit, up, revision: session.revision });
        if (count && what === 'strands') query.set('count', count);
        const path = what === 'document' ? `${session.at}?revision=${session.revision}` : `${session.at}/${what}?${query}`;
        link.href = path;
        link.download = file;
        curl.text.textContent = `curl '${location.origin}${path}' -o ${file}`;
        ctl.text.textContent = `groomctl --server ${location.origin} ` + (what === 'strands'
            ? `export ${session.id} --format ${format} --unit ${unit} --up ${up}${count ? ` --count ${count}` : ''} -o ${file}`
            : what === 'guides' ? `export ${session.id} --guides --format ${format} --unit ${unit} --up ${up} -o ${file}` : `get ${session.id} -o ${file}`);
        for (const name of ['format', 'unit', 'up']) form.elements[name].disabled = what === 'document';
        form.elements.count.disabled = what !== 'strands';
    };
    form.addEventListener('input', tell);
    session.addEventListener('revision', tell);
    tell();
    parent.append(form);
}
