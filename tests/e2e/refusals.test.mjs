// Wrong usage and wrong files: the exit status, and a way out in words.
import assert from 'node:assert/strict';
import { readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';

import { groomctl, slowness, startDaemon, temporaryFolder, worker } from '../support/daemon.mjs';
import { straightHair } from '../support/strands.mjs';

const options = { timeout: 60000 * slowness };

test('wrong usage is exit status 2 and says where the help is', options, async () => {
  for (const args of [[], ['fly'], ['upload'], ['upload', 'a', 'b'], ['fit', 'x', '--speed', '3'], ['export', 'grm_x'], ['list', 'hats'],
    ['get', 'nothing'], ['watch', '--json'], ['set', 'grm_x', 'radius=3'], ['revert', 'grm_x', 'first'], ['sample'],
    ['sample', '-o', '/tmp/x', '--style', 'bald'], ['fit', 'a.hair', '-o', 'out.xyz'], ['--server']]) {
    const result = await groomctl(null, args);
    assert.equal(result.status, 2, `${args.join(' ')}: ${result.status} ${result.stderr}`);
    assert.match(result.stderr, /usage:|--help/, args.join(' '));
    assert.equal(result.stdout, '');
  }
});

test('help is on standard output and names every command', options, async () => {
  const { status, stdout } = await groomctl(null, ['--help']);
  assert.equal(status, 0);
  for (const name of ['upload', 'fit', 'watch', 'export', 'sample']) {
    assert.match(stdout, new RegExp(`^  ${name} `, 'm'));
    assert.equal((await groomctl(null, [name, '--help'])).status, 0);
  }
});

test('a server that is not there: how to start one', options, async () => {
  const { status, stderr } = await groomctl(null, ['list', 'jobs']);
  assert.equal(status, 1);
  assert.match(stderr, /no server answers at http:\/\/127\.0\.0\.1:9/);
  assert.match(stderr, /groomd --data/);
});

test('files that are no strands are refused with the reason', options, async (t) => {
  const daemon = await startDaemon(t), folder = temporaryFolder(t), path = (name) => join(folder, name);
  const whole = straightHair(50);
  writeFileSync(path('text'), 'this is a letter, not hair\n');
  writeFileSync(path('empty'), '');
  writeFileSync(path('cut.hair'), whole.subarray(0, whole.length - 100));
  const expected = { text: /format/, empty: /empty/, 'cut.hair': /at byte \d+/, missing: /cannot be read/ };
  for (const [name, words] of Object.entries(expected)) {
    const { status, stderr } = await groomctl(daemon, ['upload', path(name)]);
    assert.equal(status, 1, name);
    assert.match(stderr, words, name);
  }
  assert.equal((await groomctl(daemon, ['--json', 'list', 'strands'])).stdout, '');
  const head = await groomctl(daemon, ['upload-head', path('text')]);
  assert.equal(head.status, 1);
});

test('a wrong unit is pointed out', options, async (t) => {
  const daemon = await startDaemon(t), folder = temporaryFolder(t), path = join(folder, 'small.hair');
  writeFileSync(path, straightHair(50));
  const { status, stderr } = await groomctl(daemon, ['upload', path, '--unit', 'mm']);
  assert.equal(status, 0, stderr);
  assert.match(stderr, /hint: .*--unit m/);
});

test('a head in another unit than its strands is pointed out, and the fit says which it is in', options, async (t) => {
  const daemon = await startDaemon(t), folder = temporaryFolder(t), path = (name) => join(folder, name);
  await groomctl(daemon, ['sample', '-o', folder, '--strands', '400', '--vertices', '24', '--guides', '20']);
  const grown = readFileSync(path('head.obj'), 'utf8').replace(/^v (\S+) (\S+) (\S+)/gm, (_, ...xyz) => `v ${xyz.slice(0, 3).map((x) => 100 * x).join(' ')}`);
  writeFileSync(path('head_cm.obj'), grown);
  const fit = (...more) => groomctl(daemon, ['fit', path('strands.hair'), '--head-file', path('head_cm.obj'), '--quality', 'draft', '--guides', '20', '-o', path('out.usda'), ...more]);
  const wrong = await fit();
  assert.notEqual(wrong.status, 0);
  assert.match(wrong.stderr, /hint: the mesh is [\d.]+ m across in the unit given; in cm it would be 0\.\d+ m\. .*--unit cm/);
  assert.match(wrong.stderr, /hint: the hair is [\d.]+ m across and the head [\d.]+ m: was one of them given another unit\?/);
  assert.match(wrong.stderr, /the head is not in the strands' unit and axis: .* but 100 % would if it were 100 times smaller/);
  const right = await fit('--head-unit', 'cm');
  assert.equal(right.status, 0, right.stderr);
  assert.doesNotMatch(right.stderr, /hint:/);
});

test('refusals of the server name the field and the way out', options, async (t) => {
  const daemon = await startDaemon(t), folder = temporaryFolder(t), path = join(folder, 'a.hair');
  writeFileSync(path, straightHair(200));
  const unknown = await groomctl(daemon, ['fit', 'str_aaaaaaaaaaaaaaaaaaaa']);
  assert.equal(unknown.status, 1);
  const job = await groomctl(daemon, ['status', 'job_aaaaaaaaaaaaaaaaaaaa']);
  assert.equal(job.status, 1);
  assert.match(job.stderr, /groomctl list/);
  const option = await groomctl(daemon, ['fit', path, '--option', 'guidse=3']);
  assert.equal(option.status, 1);
  assert.match(option.stderr, /guidse/);
  const out = await groomctl(daemon, ['export', 'grm_aaaaaaaaaaaaaaaaaaaa', '-o', join(folder, 'out.hair')]);
  assert.equal(out.status, 1);
  assert.deepEqual(readdirSync(folder), ['a.hair'], 'no half file stays');
});

test('groom-worker answers a problem for what it cannot read', options, async () => {
  const whole = straightHair(50);
  const good = await worker(['inspect', '--kind', 'strands', '--unit', 'cm'], { input: whole });
  assert.equal(good.status, 0, good.stdout);
  const seen = JSON.parse(good.stdout);
  assert.equal(seen.strands, 50);
  assert.equal(seen.format, 'hair');
  assert.ok(Math.abs(seen.length.median - 0.002) < 1e-6);
  for (const [args, input, type] of [
    [['inspect', '--kind', 'strands'], whole.subarray(0, 600), /truncated-file|invalid-file/],
    [['inspect', '--kind', 'strands'], 'letter', /unknown-format|invalid-file/],
    [['inspect', '--kind', 'strands', '--max-vertices', '10'], whole, /too-large/],
    [['inspect', '--kind', 'strands', '--unit', 'yard'], whole, /invalid-argument/],
    [['inspect', '--kind', 'head'], 'letter', /unknown-format|invalid-file|empty/],
    [['convert', '--to-format', 'tfx'], whole, /invalid-argument/],
    [['check-groom'], '{"format":"groom/1"}', /invalid/],
  ]) {
    const bad = await worker(args, { input });
    assert.equal(bad.status, 1, args.join(' '));
    const problem = JSON.parse(bad.stdout);
    assert.match(problem.type, type, args.join(' '));
    assert.ok(problem.title && problem.status >= 400);
  }
  assert.equal((await worker(['inspect'])).status, 2);
  assert.equal((await worker(['attempt'])).status, 2);
});

test('groom-worker converts between formats, units and axes', options, async () => {
  const there = await worker(['convert', '--to-format', 'ply', '--unit', 'mm', '--up', 'z', '--count', '20', '--vertices', '9'], { input: straightHair(50) });
  assert.equal(there.status, 0, there.stdout);
  const back = await worker(['inspect', '--kind', 'strands', '--unit', 'mm', '--up', 'z'], { input: there.bytes });
  const seen = JSON.parse(back.stdout);
  assert.equal(seen.strands, 20);
  assert.equal(seen.vertices, 180);
  assert.ok(Math.abs(seen.bbox.max[1] - 0.2) < 1e-5);
});
