/* Makes the pictures of the documentation with the project's own renderer: `make docs-pictures`.
 *
 * A groomd of its own, a generated sample, one operator at a time with one parameter at three values; the
 * studio's picture comes from Chromium where that is installed. BUILD is the build folder. */
import { spawn, spawnSync } from 'node:child_process';
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url)), top = resolve(here, '../..'), build = resolve(top, process.env.BUILD ?? 'build');
const pictures = join(here, 'pictures'), folder = mkdtempSync(join(tmpdir(), 'groomd-docs-'));

/* --- a daemon ------------------------------------------------------------------------------------ */

const daemon = spawn(join(build, 'groomd'), ['--data', join(folder, 'data'), '--listen', '127.0.0.1:0'], { stdio: ['ignore', 'pipe', 'ignore'] });
process.on('exit', () => { daemon.kill('SIGTERM'); rmSync(folder, { recursive: true, force: true }); });
const url = await new Promise((done, fail) => {
    daemon.on('exit', () => fail(new Error('groomd did not start')));
    daemon.stdout.on('data', (text) => { const found = /^listening on (\S+)/.exec(text); if (found) done(found[1]); });
});

async function call(method, path, body, headers = {}) {
    const response = await fetch(url + path, { method, body: body && JSON.stringify(body), headers: { ...(body && { 'Content-Type': 'application/json' }), ...headers } });
    if (!response.ok) throw new Error(`${method} ${path}: ${await response.text()}`);
    return response.status === 204 ? null : response.json();
}

async function draw(path, name) {
    const response = await fetch(url + path);
    if (!response.ok) throw new Error(`${path}: ${await response.text()}`);
    writeFileSync(join(pictures, `${name}.png`), Buffer.from(await response.arrayBuffer()));
    process.stdout.write(`${name} `);
}

function groomctl(...args) {
    const run = spawnSync(join(build, 'groomctl'), ['--server', url, ...args], { encoding: 'utf8' });
    if (run.status !== 0) throw new Error(`groomctl ${args.join(' ')}: ${run.stderr}`);
    return run.stdout.trim();
}

/* --- a head of hair with these operators alone ----------------------------------------------------------------- */

async function base(style, operators = []) {
    const at = join(folder, style);
    mkdirSync(at, { recursive: true });
    groomctl('sample', '-o', at, '--style', style, '--strands', '2500', '--vertices', '60', '--seed', '2', '--clean');
    const head = groomctl('upload-head', join(at, 'head.obj')).split(' ')[0];
    const document = JSON.parse(readFileSync(join(at, 'truth.groom.json'), 'utf8'));
    return (await call('POST', '/v1/grooms', { ...document, name: style, source: { head }, operators })).groom;
}

const revision = async (groom) => (await call('GET', `/v1/grooms/${groom}?arrays=false`)).revision;
const revert = async (groom) => call('POST', `/v1/grooms/${groom}/revert`, { revision: 1 }, { 'If-Match': `"${await revision(groom)}"` });
/* One camera for all, so that sizes can be compared. */
const CAMERA = 'azimuth=0.85&elevation=0.08&target=0,1.56,-0.01&distance=1.45&size=144';

/* --- operators --------------------------------------------------------------------------------------- */

/* What is drawn low, in the middle and high; the rest of the operator meanwhile. */
const OPERATORS = {
    scale: { random_scale: [0, 0.2, 0.5] },
    bend: { angle: [0, 0.8, 2], start: [0, 0.5, 0.9] },
    curl: { radius: [0.002, 0.006, 0.014], frequency: [10, 25, 60], random_frequency: [0, 8, 25], start: [0, 0.4, 0.8] },
    clump: { profile: [0, 1, 5] },
    frizz: { frequency: [10, 40, 150], amplitude: [0.005, 0.02, 0.06] },
};
const MEANWHILE = {
    scale: {}, bend: { angle: 1.2, start: 0.3 }, curl: { radius: 0.007, frequency: 22, random_frequency: 2, start: 0.1 }, clump: { profile: 2 },
    frizz: { frequency: 40, amplitude: 0.03 },
};
const TWISTED = { cluster: 0, at: 1 };
const LAYERS = {
    ruffle: { rho: [0, 0.1, 0.5], match_elements: [0, 8, 16], blend: [0.2, 0.6, 1] },
    sculpt: { stiffness: [0, 10, 100] },
    interpolate: { t: [0, 0.5, 1] },
    curl_scale: { radius: [0.5, 1, 1.8], step: [0.6, 1, 1.6], ramp_root: [0, 0.5, 1], ramp_tip: [0, 0.5, 1], largest_radius: [0.002, 0.01, 0] },
};

async function drawOperators(groom) {
    for (const [type, parameters] of Object.entries(OPERATORS))
        for (const [name, values] of Object.entries(parameters))
            for (const [i, value] of values.entries()) {
                const path = `/v1/grooms/${groom}`, patch = [{ op: 'add', path: '/operators', value: [{ type, ...MEANWHILE[type], [name]: value, seed: 1 }] }];
                await call('PATCH', path, patch, { 'Content-Type': 'application/json-patch+json', 'If-Match': `"${await revision(groom)}"` });
                await draw(`${path}/preview.png?${CAMERA}`, `${type}-${name}-${i + 1}`);
            }
}

/* A lock's tip goes out and up. */
async function frames(groom) {
    const { clusters } = await call('GET', `/v1/grooms/${groom}/clusters?count=6&frames=2`);
    const side = clusters.reduce((a, b) => (a.root[0] > b.root[0] ? a : b));
    return { clusters: { count: 6, seed: 1 }, frames: [{ ...TWISTED, cluster: side.cluster, transform: [[1, 0, 0, 0.09], [0, 1, 0, 0.1], [0, 0, 1, 0.05]] }] };
}

async function drawLayers(groom, other) {
    const given = { ruffle: { rho: 0.2, seed: 2, groups: 'operator_guides' }, sculpt: await frames(groom), interpolate: { groom: other }, curl_scale: { radius: 1.7 } };
    for (const [type, parameters] of Object.entries(LAYERS))
        for (const [name, values] of Object.entries(parameters))
            for (const [i, value] of values.entries()) {
                await revert(groom);
                await call('POST', `/v1/grooms/${groom}/${type.replace('_', '-')}`, { ...given[type], [name]: value });
                await draw(`/v1/grooms/${groom}/preview.png?${CAMERA}`, `${type}-${name}-${i + 1}`);
            }
    await revert(groom);
}

/* --- the tutorial -------------------------------------------------------------------------------------- */

/* The blocks of the tutorial up to where the groom is there; then its pictures. */
async function drawTutorial() {
    const at = join(folder, 'tutorial');
    mkdirSync(at);
    groomctl('sample', '-o', join(at, 'sample'), '--style', 'curly', '--strands', '4000', '--seed', '5');
    groomctl('fit', join(at, 'sample/strands.hair'), '--head-file', join(at, 'sample/head.obj'), '--quality', 'draft', '--groom-id-file', join(at, 'groom.id'));
    const groom = readFileSync(join(at, 'groom.id'), 'utf8').trim(), document = await call('GET', `/v1/grooms/${groom}?arrays=false`);
    const path = `/v1/grooms/${groom}/preview.png?azimuth=0.5&elevation=0.1&size=320`;
    await draw(`/v1/grooms/${groom}/quality.png?of=target&size=320`, 'tutorial-capture');
    await draw(`/v1/grooms/${groom}/quality.png?of=groom&size=320`, 'tutorial-groom');
    const curl = document.operators.findIndex(({ type }) => type === 'curl');
    groomctl('set', groom, `/operators/${curl}/radius=0.014`);
    await draw(path, 'tutorial-curl');
    groomctl('revert', groom, '1');
    groomctl('ruffle', groom, '--rho', '0.4', '--groups', 'operator_guides', '--seed', '7');
    await draw(path, 'tutorial-ruffle');
    await draw(`/v1/grooms/${groom}/turntable.png?frames=12&size=128&elevation=0.1&frame_ms=200`, 'tutorial-turntable');
    return groom;
}

async function drawStudio(groom) {
    const modules = join(top, 'tests/node_modules/playwright-core/index.mjs');
    if (!existsSync('/usr/bin/chromium') || !existsSync(modules)) { console.log('\nno Chromium: tutorial-studio.jpg stays as it is'); return; }
    const { chromium } = await import(modules);
    const browser = await chromium.launch({ executablePath: '/usr/bin/chromium', args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'] });
    const page = await browser.newPage({ viewport: { width: 1000, height: 640 } });
    page.setDefaultTimeout(240000);
    await page.goto(`${url}/#/grooms/${groom}`);
    await page.waitForFunction(() => window.studio?.evaluation.lit && window.studio.viewer.head);
    await page.waitForTimeout(1500);
    await page.screenshot({ path: join(pictures, 'tutorial-studio.jpg'), type: 'jpeg', quality: 70, timeout: 240000 });
    await browser.close();
}

mkdirSync(pictures, { recursive: true });
/* All, or the parts that are named: node pictures.mjs layers */
const PARTS = {
    operators: async () => drawOperators(await base('straight')),
    layers: async () => drawLayers(await base('straight', [{ type: 'curl', radius: 0.006, frequency: 22, random_frequency: 2, start: 0.1, seed: 1 }]),
        await base('straight', [{ type: 'curl', radius: 0.012, frequency: 12, random_frequency: 1, start: 0.1, seed: 1 }])),
    tutorial: async () => drawStudio(await drawTutorial()),
};
const wanted = process.argv.slice(2);
for (const [name, make] of Object.entries(PARTS)) if (!wanted.length || wanted.includes(name)) await make();
console.log('\ndone');
process.exit(0);
