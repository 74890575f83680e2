/* What was done here, as lines for a shell: docked at the foot of every page. */
import { token } from '../access.mjs';
import { commandsOf, told } from '../commands.mjs';
import { element } from '../dom.mjs';

const MOST = 50;

/* A line with its button; `label` says whose it is. */
export function copyable(label) {
    const text = element('code', {});
    const button = element('button', { type: 'button', 'aria-label': `Copy the ${label} line`, onclick: async () => {
        await navigator.clipboard?.writeText(text.textContent);
        button.textContent = 'copied';
        setTimeout(() => { button.textContent = 'copy'; }, 1500);
    } }, 'copy');
    return { text, row: element('p', { class: 'line' }, button, text) };
}

/* Both lines of a call, or of its later states: { rows, say(call) }. */
export function lines() {
    const ctl = copyable('groomctl'), curl = copyable('curl');
    return {
        rows: [ctl.row, curl.row],
        say(call) {
            const made = commandsOf(call, { origin: location.origin, withToken: Boolean(token()) });
            [ctl.text.textContent, curl.text.textContent] = [made?.groomctl ?? '', made?.curl ?? ''];
        },
    };
}

export function commandsPanel() {
    const list = element('ol', { reversed: true }), head = element('summary', {}, 'As a command');
    const panel = element('details', { class: 'commands' }, head,
        element('p', {}, 'What you do here is listed as lines for a shell, the last first. They take the daemon’s own words and run as they stand.'), list);
    told.addEventListener('call', ({ detail }) => {
        const made = commandsOf(detail, { origin: location.origin, withToken: Boolean(token()) });
        if (!made) return;
        const both = lines();
        both.say(detail);
        list.prepend(element('li', {}, element('b', {}, made.title), both.rows));
        while (list.children.length > MOST) list.lastChild.remove();
        head.textContent = `As a command (${list.children.length})`;
    });
    return element('footer', {}, panel);
}
