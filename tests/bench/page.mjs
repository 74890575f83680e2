// The page's engine: 10 000 strands of 100 vertices through five operators, in WebAssembly on one core
// (Node's V8 is Chromium's), beside libgroom on one core, in turns.
import { spawnSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join, resolve } from 'node:path';
import { performance } from 'node:perf_hooks';
import { fileURLToPath } from 'node:url';
import { Engine, Groom } from '../../client/web/engine/engine.mjs';

const top = resolve(dirname(fileURLToPath(import.meta.url)), '../..'), build = resolve(top, process.env.BUILD ?? 'build');

function sample() {
  const folder = mkdtempSync(join(tmpdir(), 'groomd-bench-'));
  spawnSync(join(build, 'groomctl'), ['sample', '-o', folder, '--style', 'curly', '--strands', '10000', '--vertices', '100', '--guides', '500', '--clean']);
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

const document = sample(), text = JSON.stringify(document);
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
