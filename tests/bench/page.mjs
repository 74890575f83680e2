// The page's engine: 10 000 strands of 100 vertices through five operators, in WebAssembly on one core of
// Node's V8, beside libgroom on one core, in turns; and where Chromium is, the studio itself: the same strands in
// its worker, and how long a groom of 100 000 takes from its address to strands that can be turned.
import test from 'node:test';
import { spawnSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join, resolve } from 'node:path';
import { performance } from 'node:perf_hooks';
import { fileURLToPath } from 'node:url';
import { Engine, Groom } from '../../client/web/engine/engine.mjs';
import { hasBrowser, startBrowser } from '../support/browser.mjs';
import { startDaemon } from '../support/daemon.mjs';

const top = resolve(dirname(fileURLToPath(import.meta.url)), '../..'), build = resolve(top, process.env.BUILD ?? 'build');

function sample(strands) {
  const folder = mkdtempSync(join(tmpdir(), 'groomd-bench-'));
  spawnSync(join(build, 'groomctl'), ['sample', '-o', folder, '--style', 'curly', '--strands', String(strands), '--vertices', '100', '--guides', '500', '--clean']);
  const document = JSON.parse(readFileSync(join(folder, 'truth.groom.json')));
  rmSync(folder, { recursive: true });
  document.operators.splice(1, 0, { type: 'bend', id: 99, angle: 0.4, start: 0.2 });
  return document;
}

function page_ms(groom) {
  let best = Infinity;
  for (let i = 0; i < 12; i++) {
    const from = performance.now();
    groom.evaluate();
    best = Math.min(best, performance.now() - from);
  }
  return best;
}

const document = sample(10000), text = JSON.stringify(document);
const engine = await Engine.load(readFileSync(join(top, 'build/web/engine.wasm')));
const groom = Groom.fromDocument(engine, document);
let page = Infinity, native = Infinity;
for (let round = 0; round < 3; round++) {
  page = Math.min(page, page_ms(groom));
  native = Math.min(native, Number(spawnSync(join(build, 'tests/bench/evaluate_document'), { input: text, maxBuffer: 1 << 24 }).stdout));
}
const names = document.operators.map((o) => o.type).join(', ');
console.log(`figure page_10k_ms ${page.toFixed(2)} ms one core, ${names}; a frame has 16`);
console.log(`figure page_ratio ${(page / native).toFixed(2)} x of libgroom on one core (${native.toFixed(2)} ms); at most 2.5`);

/** The studio over loopback in Chromium without a graphics card; ends with the test that has it. */
async function studio(t) {
  const daemon = await startDaemon(t), page = await startBrowser(t, daemon);
  const imported = async (body) => (await (await daemon.fetch('/v1/grooms', { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify(body) })).json()).groom;
  const [small, large] = [await imported(document), await imported(sample(100000))];
  await page.goto(`${daemon.url}/#/grooms/${small}`);
  await page.waitForFunction(() => window.studio?.evaluation.lit);
  const ms = await page.evaluate(async () => {
    let best = Infinity;
    for (let i = 0, spare; i < 40; i++) {
      const made = await window.studio.session.strands(Infinity, spare);
      spare = made.points;
      best = Math.min(best, made.ms);
    }
    return best;
  });
  console.log(`figure studio_10k_ms ${ms.toFixed(2)} ms the same in Chromium's worker`);
  await page.goto('about:blank');
  const from = performance.now();
  await page.goto(`${daemon.url}/#/grooms/${large}`);
  await page.waitForFunction(() => window.studio?.viewer.detail.measured);
  console.log(`figure studio_open_100k_ms ${(performance.now() - from).toFixed(0)} ms from the address to a picture of 10 000 of 100 000 strands; at most 3000`);
  const frames = await page.evaluate(async () => {
    const { viewer } = window.studio, took = [];
    const frame = () => new Promise((done) => { requestAnimationFrame(done); });
    for (let i = 0, last = performance.now(); i < 60; i++) {
      viewer.camera.position.applyAxisAngle(viewer.camera.up, 0.02);
      viewer.detail.move();
      viewer.controls.update();
      viewer.draw();
      do await frame(); while (viewer.detail.busy);
      took.push(performance.now() - last);
      last = performance.now();
    }
    return took.slice(20).sort((a, b) => a - b);
  });
  console.log(`figure studio_turn_ms ${frames[frames.length >> 1].toFixed(1)} ms a frame while it is turned, by software; the 95th of a hundred ${frames[Math.floor(frames.length * 0.95)].toFixed(1)}`);
}
if (hasBrowser) test('the studio', { timeout: 300000 }, studio);
