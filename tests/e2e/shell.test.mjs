// What a shell makes of groomctl: completion of commands, options, values and ids; the man page.
import test from 'node:test';
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { build, startDaemon } from '../support/daemon.mjs';
import { expect, groom_document } from '../support/api.mjs';

/** What bash offers for a line whose last word is being typed. */
function complete(words, env = {}) {
  const script = `source <(groomctl completion bash); COMP_WORDS=(groomctl "$@"); COMP_CWORD=$#; _groomctl; printf '%s\\n' "\${COMPREPLY[@]}"`;
  const run = spawnSync('bash', ['-c', script, 'bash', ...words], { cwd: '/', env: { ...process.env, PATH: `${build}:${process.env.PATH}`, ...env } });
  assert.equal(String(run.stderr), '');
  return String(run.stdout).trim().split('\n');
}

test('bash completes commands, options and their values', () => {
  assert.deepEqual(complete(['ex']), ['export']);
  assert.deepEqual(complete(['upload', '--uni']), ['--unit']);
  assert.deepEqual(complete(['preview', 'grm_x', '--view', 's']), ['side']);
  assert.deepEqual(complete(['list', 'gr']), ['grooms']);
  assert.ok(complete(['fit', '--']).includes('--operator-guides'));
});

test('bash completes ids of what the server holds', async (t) => {
  const daemon = await startDaemon(t);
  const { json } = await expect(daemon, 201, 'POST', '/v1/grooms', { body: groom_document() });
  assert.deepEqual(complete(['export', 'grm_'], { GROOM_SERVER: daemon.url }), [json.groom]);
});

test('zsh gets a script of its own, which parses where zsh is installed', () => {
  const script = String(spawnSync(`${build}/groomctl`, ['completion', 'zsh']).stdout);
  for (const command of complete([''])) if (!command.startsWith('-')) assert.ok(script.includes(`\n            ${command}) _arguments`), command);
  assert.match(script, /^#compdef groomctl\n/);
  const parsed = spawnSync('zsh', ['-n'], { input: script });
  if (!parsed.error) assert.equal(String(parsed.stderr), '');
});

test('the man page has every command and is clean roff', (t) => {
  const page = spawnSync(`${build}/groomctl`, ['manual']);
  assert.equal(page.status, 0);
  for (const command of complete([''])) if (!command.startsWith('-')) assert.match(String(page.stdout), new RegExp(`^\\.SS ${command.replaceAll('-', '\\\\-')}`, 'm'));
  const groff = spawnSync('groff', ['-man', '-Tutf8', '-ww'], { input: page.stdout });
  if (groff.error) { t.skip('SKIPPED: groff is not installed'); return; }
  assert.equal(String(groff.stderr), '');
});

test('a shell that it does not know is wrong usage', () => {
  assert.equal(spawnSync(`${build}/groomctl`, ['completion', 'fish']).status, 2);
});
