/* Revisions: undo, redo, and a list to go back to any of them. */
import { action, ago, by_id, element } from '../dom.mjs';

export function historyPanel(parent, session) {
    const list = element('ol', { class: 'history', reversed: true });
    const undo = action('undo', () => session.undo(), { title: 'Ctrl+Z' }), redo = action('redo', () => session.redo(), { title: 'Ctrl+Shift+Z' });
    const name = element('input', { 'aria-label': 'Name of this version', placeholder: 'name this version', onkeydown: (event) => event.key === 'Enter' && keep.click() });
    const keep = action('name', () => name.value && session.patch([{ op: 'add', path: '/name', value: name.value }]).then(() => { name.value = ''; }));
    parent.append(element('section', { class: 'panel' }, element('h2', {}, 'History'),
        element('div', { class: 'row' }, undo, redo), element('div', { class: 'row' }, name, keep), list));
    const refresh = async () => {
        const revisions = await session.revisions();
        undo.disabled = session.shown <= 1;
        redo.disabled = session.undone.length === 0;
        /* A name stays until there is another: it is shown where it was given. */
        const named = (r, i) => (r.name && r.name !== revisions[i + 1]?.name ? ` – ${r.name}` : '');
        list.replaceChildren(...revisions.map((r, i) => element('li', { value: r.revision },
            action(`${r.note || 'edit'}${named(r, i)}`, () => session.revert(r.revision).then(() => { session.shown = r.revision; }),
                { class: 'plain', disabled: r.revision === session.revision, title: 'Go back to this version' }), ` ${ago(r.created_at)} `,
            r.revision !== session.revision && element('button', { type: 'button', class: 'small', onclick: () => session.compareWith(r.revision), 'aria-label': `Revision ${r.revision} beside it` }, 'beside'))));
    };
    session.addEventListener('revision', () => refresh().catch(() => {}));
    by_id('main').addEventListener('keydown', (event) => {
        if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== 'z' || /^(INPUT|SELECT)$/.test(event.target.tagName)) return;
        event.preventDefault();
        (event.shiftKey ? redo : undo).click();
    });
    refresh().catch(() => {});
}
