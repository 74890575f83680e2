/* What a retargeting is asked for: the heads and the options, and the job's body made of them. */
import { get } from './api.mjs';
import { element, notice } from './dom.mjs';
import { upload } from './uploads.mjs';

const FIRST = ['guides', 'iterations', 'mode']; /* the others stand behind "more" */
const UNITS = ['m', 'cm', 'mm', 'dm', 'in'];

/* A control of an option by its schema: undefined where it stands at its default. */
function optionControl(name, schema) {
    const input = schema.enum
        ? element('select', { name }, schema.enum.map((value) => element('option', { selected: value === schema.default }, value)))
        : element('input', { name, type: 'number', min: schema.minimum, max: schema.maximum, step: schema.type === 'integer' ? 1 : 'any', value: schema.default });
    const given = () => (schema.enum || input.value === '' ? input.value || schema.default : Number(input.value));
    return { input, row: element('label', { title: schema.description }, name.replaceAll('_', ' '), input), value: () => (given() === schema.default ? undefined : given()) };
}

function optionsForm({ properties }) {
    const controls = Object.fromEntries(Object.entries(properties).map(([name, schema]) => [name, optionControl(name, schema)]));
    const others = Object.keys(controls).filter((name) => !FIRST.includes(name));
    const rows = [...FIRST.map((name) => controls[name].row), element('details', {}, element('summary', {}, 'more'), others.map((name) => controls[name].row))];
    const values = () => Object.fromEntries(Object.entries(controls).map(([name, control]) => [name, control.value()]).filter(([, value]) => value !== undefined));
    const valid = () => Object.values(controls).every(({ input }) => input.reportValidity());
    return { rows, values, valid };
}

/* Two heads, the source's preset to the one that the groom was made with. changed() when another is chosen. */
function headsForm(heads, own, changed) {
    const select = (label, nothing) => element('select', { 'aria-label': label, onchange: changed }, element('option', { value: '' }, nothing), heads.map((h) => element('option', { value: h.id }, h.name || h.id)));
    const source = select('Source head', 'choose the head it is on'), target = select('Target head', 'choose a head'), words = element('p', { role: 'status', class: 'hint' });
    const unit = element('select', { 'aria-label': 'Unit of the head’s file' }, UNITS.map((value) => element('option', {}, value)));
    const up = element('select', { 'aria-label': 'Up axis of the head’s file' }, element('option', { value: 'y' }, 'y up'), element('option', { value: 'z' }, 'z up'));
    const take = async ([file]) => {
        const made = await upload('heads', new URLSearchParams({ unit: unit.value, up: up.value, name: file.name }), file, (done) => { words.textContent = `${file.name}: ${Math.round(100 * done)} %`; });
        words.textContent = '';
        for (const list of [source, target]) if (!list.querySelector(`[value="${made.id}"]`)) list.append(element('option', { value: made.id }, made.name || made.id));
        target.value = made.id;
        changed();
    };
    const file = element('input', { type: 'file', accept: '.obj,.ply', 'aria-label': 'Upload a head', onchange: () => take(file.files).catch(notice).finally(() => { file.value = ''; }) });
    if (own && !source.querySelector(`[value="${own}"]`)) source.append(element('option', { value: own }, own));
    source.value = own ?? '';
    const rows = [element('label', {}, 'from', source), element('label', {}, 'to', target),
        element('details', {}, element('summary', {}, 'or upload one'), element('div', { class: 'row' }, file, unit, up)), words];
    return { rows, source, target };
}

/* subject  { strands } or { groom } of the job; own: the groom's head; chained: whether it has operators to keep */
export async function retargetForm({ subject, own, chained, changed }) {
    const [{ heads }, { retarget }] = await Promise.all(['/v1/heads?limit=200', '/v1/options'].map(get));
    const bodies = headsForm(heads, own, changed), options = optionsForm(retarget);
    const dense = element('input', { type: 'checkbox', onchange: changed });
    const given = () => ({ ...subject, ...(dense.checked && { dense: true }), source: { head: bodies.source.value } });
    return {
        ...bodies,
        parts: [element('section', { class: 'panel' }, element('h2', {}, 'Another head'), bodies.rows,
            chained && element('label', { title: 'Else guides are carried and the operators stay' }, dense, 'its strands, without operators')),
        element('section', { class: 'panel' }, element('h2', {}, 'Options'), options.rows)],
        given, valid: options.valid,
        body(hairline) {
            return { kind: 'retarget', ...given(), target: { head: bodies.target.value, ...(hairline && { hairline }) }, options: options.values() };
        },
    };
}
