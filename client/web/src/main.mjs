/* The studio: which page the address names. */
import '../node_modules/lil-gui/dist/lil-gui.css';
import 'uplot/dist/uPlot.min.css';
import './studio.css';
import { guardLinks } from './access.mjs';
import { file } from './api.mjs';
import { by_id, element, notice } from './dom.mjs';
import { groomPage } from './groom_page.mjs';
import { jobPage } from './job_page.mjs';
import { libraryPage } from './library_page.mjs';
import { commandsPanel } from './panels/commands.mjs';
import { retargetPage } from './retarget_page.mjs';

const PAGES = [[/^#\/grooms\/(grm_\w+)(?:\?strands=(\d+))?$/, groomPage], [/^#\/jobs\/(job_\w+)$/, jobPage], [/^#\/retarget\/((?:grm|str)_\w+)$/, retargetPage], [/^/, libraryPage]];
let leave = () => {}, turn = 0;

async function show() {
    const main = by_id('main'), mine = ++turn;
    leave();
    leave = () => {};
    by_id('trail').replaceChildren();
    const [pattern, page] = PAGES.find(([p]) => p.test(location.hash));
    try {
        const done = await page(main, ...location.hash.match(pattern).slice(1));
        if (mine === turn) leave = done;
        else done(); /* somebody went on meanwhile */
    } catch (error) {
        main.replaceChildren(element('p', { class: 'panel' }, 'This page could not be shown. ', element('a', { href: '#/' }, 'Back to the library')));
        notice(error);
    }
}

window.addEventListener('hashchange', show);
document.body.append(commandsPanel());
guardLinks(file, notice);
show();
