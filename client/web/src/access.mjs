/* A server with tokens: asked for when it first refuses, kept as long as the tab lives, sent with every call. */
import { element } from './dom.mjs';

const KEY = 'groomd-token';
let asking = null;

export const token = () => sessionStorage.getItem(KEY);

export const authorized = (headers = {}) => (token() ? { ...headers, Authorization: `Bearer ${token()}` } : headers);

function dialog(detail, done) {
    const input = element('input', { type: 'password', name: 'token', required: true, autocomplete: 'current-password', id: 'token' });
    const form = element('form', { method: 'dialog' }, element('h2', {}, 'This server asks for a token'), element('p', {}, detail),
        element('p', {}, 'Whoever runs it makes one with ', element('code', {}, 'groomd token create --name NAME'), '.'),
        element('label', { for: 'token' }, 'token', input),
        element('div', { class: 'row' }, element('button', { type: 'submit' }, 'Enter'), element('button', { type: 'button', onclick: () => box.close() }, 'Not now')));
    const box = element('dialog', { 'aria-label': 'Token' }, form);
    form.addEventListener('submit', (event) => {
        event.preventDefault();
        sessionStorage.setItem(KEY, input.value.trim());
        box.close('entered');
    });
    box.addEventListener('close', () => {
        box.remove();
        done(box.returnValue === 'entered');
    });
    document.body.append(box);
    box.showModal();
}

/* Asks for a token in place of the one that was refused; one dialog however many calls wait for it.
 * returns  whether there is another now */
export function ask(refused, detail) {
    if (token() !== refused) return Promise.resolve(true); /* entered while the call was under way */
    sessionStorage.removeItem(KEY);
    asking ??= new Promise((resolve) => { dialog(detail, resolve); }).finally(() => { asking = null; });
    return asking;
}

/* Links to what the daemon sends cannot carry a token: they are fetched and handed over. */
export function guardLinks(fetchBytes, failed) {
    document.addEventListener('click', (event) => {
        const link = event.target.closest?.('a[href^="/v1/"]');
        if (!link || !token() || event.defaultPrevented) return;
        event.preventDefault();
        const { href, download, target } = link;
        fetchBytes(new URL(href).pathname + new URL(href).search).then(({ bytes, type, name }) => {
            const url = URL.createObjectURL(new Blob([bytes], { type }));
            if (target === '_blank') window.open(url);
            else element('a', { href: url, download: download || name }).click();
            setTimeout(() => URL.revokeObjectURL(url), 60000);
        }).catch(failed);
    });
}
