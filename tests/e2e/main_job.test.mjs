// The main job on a generated sample, through groomctl alone: sample, upload, fit, watch, export, preview.
import assert from 'node:assert/strict';
import { existsSync, readFileSync, readdirSync, statSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';

import { groomctl, slowness, startDaemon, temporaryFolder } from '../support/daemon.mjs';
import { box, readHair } from '../support/strands.mjs';

const options = { timeout: 240000 * slowness };

async function ok(daemon, args, more) {
  const result = await groomctl(daemon, args, more);
  assert.equal(result.status, 0, `groomctl ${args.join(' ')}: ${result.status}\n${result.stderr}${result.stdout}`);
  return result;
}

test('a sample goes in step by step and comes out as HAIR, USD and a picture', options, async (t) => {
  const daemon = await startDaemon(t), folder = temporaryFolder(t), sample = join(folder, 'sample');
  await ok(null, ['sample', '--style', 'wavy', '--strands', '3000', '--seed', '4', '-o', sample]);
  assert.deepEqual(readdirSync(sample).sort(), ['cameras.json', 'head.obj', 'strands.hair', 'truth.groom.json']);

  const [strands] = (await ok(daemon, ['--json', 'upload', join(sample, 'strands.hair')])).lines();
  const [head] = (await ok(daemon, ['--json', 'upload-head', join(sample, 'head.obj')])).lines();
  assert.match(strands.id, /^str_/);
  assert.match(head.id, /^head_/);
  const again = (await ok(daemon, ['--json', 'upload', join(sample, 'strands.hair')])).lines()[0];
  assert.equal(again.id, strands.id);

  const [job] = (await ok(daemon, ['--json', 'fit', strands.id, '--head', head.id, '--guides', '100', '--quality', 'draft'])).lines();
  assert.match(job.id, /^job_/);
  const events = (await ok(daemon, ['--json', 'watch', job.id])).lines();
  assert.ok(events.every((e) => e.job === job.id && e.event));
  assert.ok(events.some((e) => e.event === 'stage' && e.name === 'initialize') || events.some((e) => e.stage?.name === 'initialize'));
  assert.equal(events.at(-1).state, 'succeeded');

  const [state] = (await ok(daemon, ['status', '--json', job.id])).lines();
  const groom = state.result.groom;
  assert.match(groom, /^grm_/);
  assert.match((await ok(daemon, ['status', job.id])).stdout, /100 %.*succeeded.*grm_/);

  const hair = join(folder, 'out.hair'), usd = join(folder, 'out.usda'), png = join(folder, 'front.png');
  await ok(daemon, ['export', groom, '-o', hair]);
  await ok(daemon, ['export', groom, '-o', usd, '--unit', 'cm', '--up', 'z']);
  await ok(daemon, ['preview', groom, '-o', png, '--size', '256']);
  const dense = readHair(hair), bounds = box(dense.points), given = strands.bbox;
  assert.equal(dense.n_strands, strands.strands);
  for (let i = 0; i < 3; i++) {
    const slack = 0.25 * (given.max[i] - given.min[i]) + 0.02;
    assert.ok(Math.abs(bounds.minimum[i] - given.min[i]) < slack && Math.abs(bounds.maximum[i] - given.max[i]) < slack, `axis ${i}`);
  }
  assert.match(readFileSync(usd, 'utf8').slice(0, 400), /^#usda 1\.0/);
  assert.equal(readFileSync(png).toString('latin1', 1, 4), 'PNG');
  assert.ok(statSync(png).size > 2000, 'the picture is blank');

  const above = join(folder, 'above.png'), turn = join(folder, 'turn.png'), stills = join(folder, 'turn');
  await ok(daemon, ['preview', groom, '-o', above, '--size', '128x96', '--azimuth', '-40', '--elevation', '90', '--light', 'front']);
  assert.deepEqual([readFileSync(above).readUInt32BE(16), readFileSync(above).readUInt32BE(20)], [128, 96]);
  await ok(daemon, ['preview', groom, '-o', above, '--size', '128', '--eye', '0.5,1.8,0.9', '--target', '0,1.6,0', '--fov', '25']);
  await ok(daemon, ['turntable', groom, '-o', turn, '--frames', '3', '--size', '96', '--seconds', '1.5']);
  assert.ok(readFileSync(turn).includes('acTL'), 'it is animated');
  await ok(daemon, ['turntable', groom, '--stills', stills, '--frames', '3', '--size', '96']);
  assert.deepEqual(readdirSync(stills), ['frame_0000.png', 'frame_0001.png', 'frame_0002.png']);
  for (const wrong of [['--frames', '1', '-o', turn], ['--seconds', 'x', '-o', turn], ['--elevation', 'up', '-o', turn], []])
    assert.equal((await groomctl(daemon, ['turntable', groom, ...wrong])).status, 2);
  assert.match((await groomctl(daemon, ['preview', groom, '-o', above, '--eye', '0,0,1'])).stderr, /needs a target/);

  const fewer = join(folder, 'few.hair'), guides = join(folder, 'guides.hair');
  await ok(daemon, ['export', groom, '-o', fewer, '--count', '100']);
  await ok(daemon, ['export', groom, '-o', guides, '--guides']);
  assert.equal(readHair(fewer).n_strands, 100);
  assert.equal(readHair(guides).n_strands, 100);
});

test('a groom is edited, looked back at and reverted', options, async (t) => {
  const daemon = await startDaemon(t), folder = temporaryFolder(t), id_file = join(folder, 'id');
  await ok(null, ['sample', '--style', 'curly', '--strands', '500', '-o', join(folder, 's')]);
  await ok(daemon, ['fit', join(folder, 's/strands.hair'), '--guides', '40', '--quality', 'draft', '--groom-id-file', id_file]);
  const groom = readFileSync(id_file, 'utf8').trim();
  const document = JSON.parse((await ok(daemon, ['--json', 'get', groom])).stdout);
  const curl = document.operators.findIndex((o) => o.type === 'curl');
  assert.ok(curl >= 0, 'the chain has a curl');

  const first = await ok(daemon, ['export', groom, '--format', 'hair', '-o', '-']);
  assert.match((await ok(daemon, ['set', groom, `/operators/${curl}/radius=0.02`, '/name=curls'])).stdout, /revision 2/);
  const second = await ok(daemon, ['export', groom, '--format', 'hair', '-o', '-']);
  assert.ok(!first.bytes.equals(second.bytes), 'a wider curl moves the hair');

  const stale = await groomctl(daemon, ['set', groom, `/operators/${curl}/radius=0.03`, '--if-match', '1']);
  assert.equal(stale.status, 1);
  assert.match(stale.stderr, /changed meanwhile/);
  const wrong = await groomctl(daemon, ['set', groom, `/operators/${curl}/radius=-5`]);
  assert.equal(wrong.status, 1);
  assert.match(wrong.stderr, new RegExp(`/operators/${curl}/radius`));

  await ok(daemon, ['revert', groom, '1']);
  const third = await ok(daemon, ['export', groom, '--format', 'hair', '-o', '-']);
  assert.ok(first.bytes.equals(third.bytes), 'reverted is the same bits');
  assert.equal((await ok(daemon, ['--json', 'revisions', groom])).lines().length, 3);

  const whole = join(folder, 'groom.json');
  await ok(daemon, ['get', groom, '-o', whole]);
  const copy = (await ok(daemon, ['import', whole])).stdout.trim();
  assert.notEqual(copy, groom);
  const copied = await ok(daemon, ['export', copy, '--format', 'hair', '-o', '-']);
  assert.ok(copied.bytes.equals(third.bytes), 'a document posted again is the same strands, bit for bit');
});

test('one line goes from a file to a groom in a file', options, async (t) => {
  const daemon = await startDaemon(t), folder = temporaryFolder(t), out = join(folder, 'out.hair');
  await ok(null, ['sample', '--style', 'short', '--strands', '800', '-o', join(folder, 's')]);
  const { stdout } = await ok(daemon, ['fit', join(folder, 's/strands.hair'), '--head-file', join(folder, 's/head.obj'), '--guides', '50', '-o', out]);
  assert.match(stdout, /initialize.*\n/);
  assert.match(stdout, /succeeded: grm_/);
  assert.ok(existsSync(out) && readHair(out).n_strands > 0);
  assert.deepEqual(readdirSync(folder).sort(), ['out.hair', 's'], 'no temporary file stays');
  for (const what of ['strands', 'heads', 'jobs', 'grooms'])
    assert.equal((await ok(daemon, ['--json', 'list', what])).lines().length, 1, what);
  await ok(daemon, ['health']);
  assert.match((await ok(daemon, ['options'])).stdout, /stages\.initialize\./);
});
