/* A few words for building pages. */

/* element('button', { class: 'wide', onclick }, 'Fit') */
export function element(name, attributes = {}, ...children) {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) {
        if (key.startsWith('on')) made.addEventListener(key.slice(2), value);
        else if (value === true) made.setAttribute(key, '');
        else if (value !== false && value != null) made.setAttribute(key, value);
    }
    made.append(...children.flat().filter((child) => child != null && child !== false));
    return made;
}

export const by_id = (id) => document.getElementById(id);

/* What went wrong, in the server's words, until it is dismissed. */
export function notice(error) {
    const text = error.detail ?? error.message ?? String(error);
    const box = element('p', {}, text, ' ', element('button', { onclick: () => box.remove(), 'aria-label': 'Dismiss' }, '×'));
    by_id('notices').append(box);
    setTimeout(() => box.remove(), 15000);
}

export const say = (text) => { by_id('status').textContent = text; };

/* A button that is off while its work is under way and shows its failure. */
export function action(label, work, attributes = {}) {
    const button = element('button', {
        type: 'button', ...attributes, onclick: async () => {
            button.disabled = true;
            try { await work(); } catch (error) { notice(error); } finally { button.disabled = false; }
        },
    }, label);
    return button;
}

export const ago = (time) => {
    const seconds = (Date.now() - Date.parse(time)) / 1000;
    if (seconds < 90) return 'just now';
    if (seconds < 5400) return `${Math.round(seconds / 60)} min ago`;
    if (seconds < 129600) return `${Math.round(seconds / 3600)} h ago`;
    return new Date(time).toLocaleDateString();
};

export const whole = (n) => Number(n).toLocaleString('en').replaceAll(',', '\u202f');
