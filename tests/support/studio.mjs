// What tests of the studio share: a sample, and looks at what the page shows.
import { spawnSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import assert from 'node:assert/strict';
import { hasBrowser } from './browser.mjs';
import { build, temporaryFolder } from './daemon.mjs';

export const skip = hasBrowser ? false : 'SKIPPED: /usr/bin/chromium is not installed';

/** A folder with strands.hair, head.obj and truth.groom.json. */
export function sample(t, ...options) {
  const folder = temporaryFolder(t);
  const made = spawnSync(join(build, 'groomctl'), ['sample', '-o', folder, '--style', 'curly', '--strands', '400', '--vertices', '48', '--guides', '40', ...options]);
  assert.equal(made.status, 0, String(made.stderr));
  return folder;
}

/** The sample's truth as a groom of the daemon: its id. */
export async function imported(daemon, folder, headers = {}) {
  const answer = await daemon.fetch('/v1/grooms', { method: 'POST', headers: { 'Content-Type': 'application/json', ...headers }, body: readFileSync(join(folder, 'truth.groom.json')) });
  assert.equal(answer.status, 201);
  return (await answer.json()).groom;
}

/** The strands that the page shows in the order of a file, [count * vertices * 3]. */
export const shown = (page) => page.evaluate(() => {
  const { evaluation: { strands: { points, vertices } }, session: { slotOf } } = window.studio;
  return Array.from(slotOf).flatMap((slot) => Array.from(points.slice(3 + 3 * slot * vertices, 3 + 3 * (slot + 1) * vertices)));
});

/** Waits until the page has settled on a revision, all of its strands evaluated. */
export const settled = (page, revision) => page.waitForFunction((r) => {
  const { session, evaluation } = window.studio ?? {};
  return session?.revision === r && !session.busy && evaluation.strands && !evaluation.running && evaluation.strands.evaluated === evaluation.strands.count;
}, revision);

/** How many pixels of the canvas differ from its background by more than a little. */
export const drawn = (page) => page.evaluate(() => {
  const source = document.querySelector('.picture canvas'), copy = document.createElement('canvas');
  [copy.width, copy.height] = [source.width, source.height];
  const context = copy.getContext('2d');
  context.drawImage(source, 0, 0);
  const { data } = context.getImageData(0, 0, copy.width, copy.height);
  let n = 0;
  for (let i = 0; i < data.length; i += 4) n += Math.abs(data[i] - data[0]) + Math.abs(data[i + 1] - data[1]) > 24;
  return n / (data.length / 4);
});
