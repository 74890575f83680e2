// The tutorial's lines do what it says, as they stand, block after block in one shell; and the help is served.
import test from 'node:test';
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { existsSync, readFileSync, readdirSync, statSync } from 'node:fs';
import { createServer } from 'node:net';
import { join, resolve } from 'node:path';
import { Engine } from '../../client/web/engine/engine.mjs';
import { build, slowness, startDaemon, temporaryFolder } from '../support/daemon.mjs';
import { readHair } from '../support/strands.mjs';

const docs = resolve('client/docs');
const blocks = [...readFileSync(join(docs, 'tutorial.md'), 'utf8').matchAll(/^```sh\n([^]*?)^```$/gm)].map(([, text]) => text);

const freePort = () => new Promise((done) => {
  const server = createServer().listen(0, '127.0.0.1', () => { const { port } = server.address(); server.close(() => done(port)); });
});

test('the tutorial, line by line', { timeout: 400000 * slowness }, async (t) => {
  const folder = temporaryFolder(t), at = `127.0.0.1:${await freePort()}`;
  const script = `set -eo pipefail\n${blocks.join('\n')}`;
  const env = { ...process.env, PATH: `${build}:${process.env.PATH}`, GROOMD_LISTEN: at, GROOM_SERVER: `http://${at}`, HOME: folder, XDG_STATE_HOME: folder };
  const child = spawn('bash', ['-c', script], { cwd: folder, env, detached: true });
  t.after(() => { try { process.kill(-child.pid, 'SIGKILL'); } catch { /* it has ended */ } });
  let output = '';
  for (const stream of [child.stdout, child.stderr]) stream.on('data', (bytes) => { output += bytes; });
  const code = await new Promise((done) => child.on('close', done));
  assert.equal(code, 0, output);
  for (const name of ['groom.usda', 'guides.obj', 'curl.png', 'ruffle.png', 'turn.png', 'groom.json', 'wide.usda']) assert.ok(statSync(join(folder, name)).size > 1000, name);
  assert.equal(readHair(join(folder, 'tenth.hair')).n_strands, 400);
  assert.notDeepEqual(readFileSync(join(folder, 'curl.png')), readFileSync(join(folder, 'ruffle.png')));
  const groom = JSON.parse(readFileSync(join(folder, 'groom.json'), 'utf8'));
  assert.equal(groom.operators.at(-1).type, 'ruffle');
  assert.equal(groom.revision, 5, 'the knob, back, guides, ruffle');
});

test('every parameter of every operator has its line and its three pictures', async () => {
  const engine = await Engine.load(readFileSync(resolve('build/web/engine.wasm'))), page = readFileSync(join(docs, 'operators.md'), 'utf8');
  for (const { name, parameters } of engine.types) {
    const section = page.split(/^## /m).find((text) => text.startsWith(`${name}\n`));
    assert.ok(section, name);
    for (const parameter of parameters) {
      assert.ok(section.includes(`**\`${parameter.name}\`**`), `${name}: ${parameter.name}`);
      for (const i of [1, 2, 3]) assert.ok(section.includes(`pictures/${name}-${parameter.name}-${i}.png`), `${name}: picture ${i} of ${parameter.name}`);
    }
  }
});

test('the help is served with its pictures, and each link leads somewhere', async (t) => {
  const daemon = await startDaemon(t), seen = new Set(), waiting = ['/docs/'];
  while (waiting.length) {
    const path = waiting.pop().replace(/#.*/, '');
    if (seen.has(path) || !path.startsWith('/')) continue;
    seen.add(path);
    const response = await daemon.fetch(path), type = response.headers.get('content-type');
    assert.equal(response.status, 200, path);
    assert.ok(response.headers.get('etag') || !path.startsWith('/docs'), path);
    if (!path.startsWith('/docs')) continue;
    const bytes = Buffer.from(await response.arrayBuffer());
    if (/html/.test(type)) {
      assert.match(response.headers.get('content-security-policy'), /default-src 'none'/);
      const html = bytes.toString();
      assert.doesNotMatch(html, /<script|(src|href)="https?:/, path);
      waiting.push(...[...html.matchAll(/(?:src|href)="([^"]+)"/g)].map(([, to]) => to).filter((to) => !to.startsWith('data:')));
    }
  }
  for (const name of readdirSync(join(docs, 'pictures'))) assert.ok(seen.has(`/docs/${name}`), `no page shows ${name}`);
  assert.equal((await daemon.fetch('/docs/nothing.html')).status, 404);
});

test('links of the files themselves lead to files', () => {
  for (const name of readdirSync(docs).filter((file) => file.endsWith('.md')))
    for (const [, to] of readFileSync(join(docs, name), 'utf8').matchAll(/\]\(([^)#]+)\)/g))
      if (!to.startsWith('/')) assert.ok(existsSync(join(docs, to)), `${name}: ${to}`);
});
