// Real captures through the whole service: each to a groom, and back out as HAIR and USD.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';

import { groomctl, sharedData, slowness, startDaemon, temporaryFolder } from '../support/daemon.mjs';
import { box, readHair } from '../support/strands.mjs';

const captures = [
  { name: 'harolongo', strands: 'harolongo/hair.data', head: 'harolongo/body.obj', unit: 'cm', up: 'y', n: 7905 },
  { name: 'sintel', strands: 'sintel/hair.tfx', head: 'sintel/head.obj', unit: 'm', up: 'y', n: 11400 },
  { name: 'combover', strands: 'combover/hair.data', head: 'combover/body.obj', unit: 'm', up: 'z', n: 30534 },
  { name: 'mohawk', strands: 'mohawk/hair.tfx', unit: 'm', up: 'y', n: 2228 },
  { name: 'bangs100', strands: 'bangs100/Bangs_100.hair', unit: 'mm', up: 'z', n: 100, guides: 20 },
];

for (const capture of captures) {
  const strands = sharedData(capture.strands), head = capture.head && sharedData(capture.head);
  const skip = strands && (head || !capture.head) ? false : `needs ../shared/data/${capture.strands}`;
  test(`${capture.name} becomes a groom and comes back as HAIR and USD`, { timeout: 300000 * slowness, skip }, async (t) => {
    const daemon = await startDaemon(t), folder = temporaryFolder(t);
    const hair = join(folder, 'out.hair'), usd = join(folder, 'out.usda'), id = join(folder, 'id');
    const fit = await groomctl(daemon, ['fit', strands, ...(head ? ['--head-file', head] : []), '--unit', capture.unit, '--up', capture.up,
      '--guides', String(capture.guides ?? 200), '--groom-id-file', id], { timeout_ms: 240000 });
    assert.equal(fit.status, 0, fit.stderr + fit.stdout);
    const groom = readFileSync(id, 'utf8').trim();
    for (const path of [hair, usd]) {
      const out = await groomctl(daemon, ['export', groom, '-o', path, '--unit', capture.unit, '--up', capture.up]);
      assert.equal(out.status, 0, out.stderr);
    }

    const [given] = (await groomctl(daemon, ['--json', 'list', 'strands'])).lines();
    const metres = join(folder, 'metres.hair');
    assert.equal((await groomctl(daemon, ['export', groom, '-o', metres])).status, 0);
    const dense = readHair(metres), bounds = box(dense.points);
    assert.ok(Math.abs(dense.n_strands - capture.n) <= 0.02 * capture.n, `${dense.n_strands} of ${capture.n} strands`);
    assert.equal(readHair(hair).n_strands, dense.n_strands);
    const scale = { cm: 100, m: 1, mm: 1000 }[capture.unit];
    const height = (b, axis) => b.maximum[axis] - b.minimum[axis];
    const tall = height(box(readHair(hair).points), capture.up === 'z' ? 2 : 1);
    assert.ok(Math.abs(tall / scale - height(bounds, 1)) < 1e-3 * height(bounds, 1) + 1e-5, 'the export stands in the unit and axis asked for');
    if (given.bbox) for (let i = 0; i < 3; i++) {
      const slack = 0.3 * (given.bbox.max[i] - given.bbox.min[i]) + 0.02;
      assert.ok(bounds.minimum[i] > given.bbox.min[i] - slack && bounds.maximum[i] < given.bbox.max[i] + slack, `axis ${i} stays where the capture is`);
    }
    const text = readFileSync(usd, 'utf8');
    assert.match(text, /^#usda 1\.0/);
    assert.match(text, /BasisCurves/);
    t.diagnostic(`${dense.n_strands} strands in ${(fit.ms / 1000).toFixed(1)} s`);
  });
}
