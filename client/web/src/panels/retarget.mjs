/* A groom and other heads: the way to one, and, where it was carried here, the report of that. */
import { element } from '../dom.mjs';

const number = (value) => (value === undefined ? '–' : value === 0 ? '0' : Math.abs(value) >= 1e5 || Math.abs(value) < 1e-3 ? value.toExponential(2) : Number(value.toPrecision(4)).toLocaleString('en').replaceAll(',', '\u202f'));
const mm = (metres) => (metres === undefined ? '–' : `${(1000 * metres).toFixed(2)} mm`);
const row = (name, ...cells) => element('tr', {}, element('th', { scope: 'row' }, name), cells.map((text) => element('td', {}, text)));
const pair = (name, { before = {}, after = {} } = {}, member, text = number) => row(name, text(before[member]), text(after[member]));

function pairs({ energy, inside }) {
    return element('table', {}, element('thead', {}, element('tr', {}, element('td', {}), element('th', { scope: 'col' }, 'transfer'), element('th', { scope: 'col' }, 'result'))),
        element('tbody', {}, pair('energy', energy, 'total'), pair('of shape', energy, 'shape'), pair('among strands', energy, 'inter'), pair('about the body', energy, 'body'),
            pair('vertices inside', inside, 'vertices'), pair('segments inside', inside, 'segments'), pair('deepest', inside, 'deepest', mm)));
}

function measures({ length_ratio: share, movement }, hairline) {
    const percent = (x) => `${(100 * x).toFixed(1)} %`;
    return element('table', {}, element('tbody', {},
        share && row('length over the source’s', `${share.min.toFixed(3)} to ${share.max.toFixed(3)}`),
        share && row('in the median', share.median.toFixed(3)),
        movement && row('moved, mean', mm(movement.mean)),
        hairline?.density_l1 !== undefined && row('change of density', `${percent(hairline.density_l1)}, at most ${percent(hairline.density_linf)}`),
        hairline?.bald ? row('strands given up', number(hairline.bald)) : null));
}

export function retargetPanel(parent, session) {
    const { retarget } = session.document, from = retarget?.from ?? {}, report = retarget?.report;
    parent.append(element('section', { class: 'panel report' }, element('h2', {}, 'Another head'),
        retarget && element('p', { class: 'hint' }, 'Carried here from ', from.groom ? element('a', { href: `#/grooms/${from.groom}` }, 'its groom') : 'uploaded strands', '. Colours of it are in the view.'),
        report && [pairs(report), measures(report, retarget.hairline)],
        element('div', { class: 'row' }, element('a', { class: 'button', href: `#/retarget/${session.id}` }, 'Carry to another head'))));
}
