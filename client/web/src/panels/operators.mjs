/* The chain: a folder an operator, a slider a parameter, with the library's own ranges and words. */
import GUI from 'lil-gui';
import { element, notice } from '../dom.mjs';

const LABELS = { m: 'mm', rad: '°', '1/m': '/cm' };
/* What a groomer reads, from what the document holds. */
const SCALES = { m: 1000, rad: 180 / Math.PI, '1/m': 0.01 };
/* Layers that mean nothing without a hand or another groom. */
const NOT_ADDED = ['sculpt', 'interpolate'];

function parameterSlider(folder, session, index, parameter) {
    const { name, unit, minimum, slider_maximum: top, initial, help } = parameter, scale = SCALES[unit] ?? 1;
    const operator = session.operators[index];
    const shown = { value: (operator[name] ?? initial) * scale };
    const low = Math.max(minimum, minimum < 0 ? -top : minimum) * scale;
    const controller = folder.add(shown, 'value', low, top * scale, ...(unit === 'count' ? [1] : [])).name(`${name.replaceAll('_', ' ')}${LABELS[unit] ? ` (${LABELS[unit]})` : ''}`);
    controller.decimals(2);
    controller.onChange((value) => session.turn(index, name, value / scale).catch(notice));
    controller.onFinishChange(() => session.settle(index, name).catch(notice));
    controller.domElement.title = `${help}. Double click for the start value.`;
    controller.domElement.querySelector('.lil-name').addEventListener('dblclick', () => {
        controller.setValue(initial * scale);
        session.settle(index, name).catch(notice);
    });
}

/* Its parameters as they were in the first revision; as a new one has them where it came later. */
async function reset(session, operator, type, at) {
    const first = await session.original(operator.id), changes = [];
    for (const { name, initial } of type.parameters) {
        const value = first?.[name] ?? initial;
        if (Math.abs((operator[name] ?? initial) - value) > 1e-7 * Math.abs(value)) changes.push({ op: 'add', path: `${at}/${name}`, value });
    }
    if (changes.length) await session.patch(changes);
}

function operatorFolder(gui, session, types, index) {
    const operator = session.operators[index], type = types.find((t) => t.name === operator.type);
    const folder = gui.addFolder(`${index + 1}  ${operator.type}`), patch = (operations) => session.patch(operations).catch(notice);
    const at = `/operators/${index}`;
    for (const parameter of type?.parameters ?? []) parameterSlider(folder, session, index, parameter);
    const on = operator.enabled !== false;
    const actions = {
        [on ? 'switch off' : 'switch on']: () => patch([{ op: 'add', path: `${at}/enabled`, value: !on }]),
        'reset': () => reset(session, operator, type, at).catch(notice),
        'new seed': () => patch([{ op: 'add', path: `${at}/seed`, value: (operator.seed ?? 1) + 1 }]),
        'earlier': () => index > 0 && patch([{ op: 'move', from: at, path: `/operators/${index - 1}` }]),
        'later': () => index + 1 < session.operators.length && patch([{ op: 'move', from: at, path: `/operators/${index + 1}` }]),
        'remove': () => patch([{ op: 'remove', path: at }]),
    };
    const row = element('div', { class: 'row' });
    for (const [label, work] of Object.entries(actions))
        if (label !== 'new seed' || type?.random.length || type?.name === 'ruffle')
            row.append(element('button', { type: 'button', onclick: work, 'aria-label': `${label}: ${operator.type}` }, label));
    folder.$children.append(row);
    if (!on) folder.close();
}

/* Built anew whenever the document's chain has changed. */
export function operatorsPanel(parent, session, types) {
    let gui;
    const build = () => {
        gui?.destroy();
        gui = new GUI({ container: parent, injectStyles: false, title: 'Operators' });
        session.operators.forEach((_, index) => operatorFolder(gui, session, types, index));
        const choose = element('select', { 'aria-label': 'Operator to add' }, types.filter((t) => !NOT_ADDED.includes(t.name)).map((t) => element('option', {}, t.name)));
        gui.$children.append(element('div', { class: 'row' }, choose, element('button', {
            type: 'button',
            onclick: () => session.patch([{ op: 'add', path: '/operators/-', value: { type: choose.value } }]).catch(notice),
        }, 'add')));
    };
    build();
    session.addEventListener('document', build);
}
