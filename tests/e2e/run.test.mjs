// `make run` after the build: from nothing to a fitted groom, its strands, a picture and an address.
import assert from 'node:assert/strict';
import { execFile } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, statSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';
import { promisify } from 'node:util';

test('the sample run ends with a groom, its strands and a picture', { timeout: 300000 }, async (t) => {
  const place = mkdtempSync(join(tmpdir(), 'groomd-run-'));
  t.after(() => rmSync(place, { recursive: true, force: true }));
  const env = { ...process.env, GROOM_PLACE: place, GROOM_RUN_ONCE: '1', GROOM_LISTEN: '127.0.0.1:0' };
  const { stdout } = await promisify(execFile)('deploy/run.sh', [], { env });
  assert.match(stdout, /The sample is a groom now: grm_/);
  assert.match(stdout, /look at it +http:\/\/127\.0\.0\.1:\d+\//);
  assert.equal(readFileSync(join(place, 'groom.hair')).subarray(0, 4).toString(), 'HAIR');
  assert.match(readFileSync(join(place, 'groom.usda')).subarray(0, 5).toString(), /^#usda/);
  assert.equal(readFileSync(join(place, 'preview.png')).subarray(1, 4).toString(), 'PNG');
  assert.ok(statSync(join(place, 'preview.png')).size > 50000, 'a picture with something in it');
});
