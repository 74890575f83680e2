// The studio against a server that asks for a token, over a line that breaks, with cameras and colours.
import test from 'node:test';
import assert from 'node:assert/strict';
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { build, run, startDaemon, until } from '../support/daemon.mjs';
import { picture, startBrowser } from '../support/browser.mjs';
import { drawn, imported, sample, settled, shown, skip } from '../support/studio.mjs';

/** What the canvas shows, coarsely: a mean colour of each of 8 x 8 fields. */
const fields = (page) => page.evaluate(() => {
  const source = document.querySelector('.picture canvas'), copy = document.createElement('canvas');
  [copy.width, copy.height] = [8, 8];
  const context = copy.getContext('2d');
  context.drawImage(source, 0, 0, 8, 8);
  return Array.from(context.getImageData(0, 0, 8, 8).data);
});
const apart = (a, b) => a.reduce((sum, x, i) => sum + Math.abs(x - b[i]), 0) / a.length;

test('a server with tokens: asked for once, sent with every call, the events, pictures and downloads', { skip, timeout: 300000 }, async (t) => {
  const daemon = await startDaemon(t), folder = sample(t), page = await startBrowser(t, daemon);
  const made = await run(join(build, 'groomd'), ['token', 'create', '--data', daemon.data, '--name', 'ann', '--json']);
  const { token } = JSON.parse(made.stdout);
  const headers = { Authorization: `Bearer ${token}` }, groom = await imported(daemon, folder, headers);
  page.removeAllListeners('console'); /* refusals are told there */
  await page.goto(daemon.url);
  await t.test('a wrong one is asked for again', async () => {
    await page.getByLabel('token', { exact: true }).fill(`${token.slice(0, -2)}xx`);
    await page.getByRole('button', { name: 'Enter' }).click();
    await page.getByRole('dialog').getByText(/token/).first().waitFor();
    await page.getByLabel('token', { exact: true }).fill(token);
    await page.getByRole('button', { name: 'Enter' }).click();
    await page.locator('.grooms img').first().waitFor();
  });
  await t.test('pictures come', () => page.waitForFunction(() => document.querySelector('.grooms img')?.naturalWidth === 256));
  await t.test('a fit is followed to its end', async () => {
    await page.setInputFiles('#files', [join(folder, 'strands.hair'), join(folder, 'head.obj')]);
    await page.getByLabel('Quality').selectOption('draft');
    await page.getByRole('button', { name: 'fit strands.hair' }).click();
    await page.getByRole('link', { name: 'Open the groom' }).waitFor();
    assert.ok(await page.locator('.plots figure').count() > 0, 'losses came along the event stream');
  });
  await t.test('a reload asks for nothing, and a download carries the token', async () => {
    await page.goto(`${daemon.url}/#/grooms/${groom}`);
    await page.reload();
    await settled(page, 1);
    assert.equal(await page.getByRole('dialog').count(), 0);
    await page.locator('select[name=format]').selectOption('data');
    const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('link', { name: 'Download' }).click()]);
    assert.match(download.suggestedFilename(), /\.data$/);
  });
  await t.test('another session is asked again', async () => {
    const other = await page.context().browser().newPage();
    await other.goto(daemon.url);
    await other.getByRole('dialog').waitFor();
    await other.close();
  });
});

test('an upload outlives a broken line and a reload', { skip, timeout: 300000 }, async (t) => {
  const daemon = await startDaemon(t), folder = sample(t, '--strands', '20000', '--vertices', '100'), page = await startBrowser(t, daemon);
  const file = join(folder, 'strands.hair'), pieces = [];
  page.removeAllListeners('console'); /* the lines that break */
  await page.route('**/v1/uploads/*', async (route) => {
    const request = route.request();
    if (request.method() !== 'PATCH') return route.continue();
    pieces.push(Number(request.headers()['upload-offset']));
    return pieces.length === 2 || pieces.length > 3 ? route.abort() : route.continue(); /* the second breaks; from the fourth on all do */
  });
  await page.goto(daemon.url);
  await page.setInputFiles('#files', file);
  await page.waitForFunction(() => /trying again/.test(document.querySelector('.drop .hint').textContent));
  await until('the line to break for good', () => pieces.length > 3, 60000);
  assert.deepEqual(pieces.slice(0, 3), [0, 8 << 20, 8 << 20], 'what broke was sent again, from where it broke');
  await page.unroute('**/v1/uploads/*');
  await page.reload();
  await page.getByText(/% has arrived. Choose the file again/).waitFor();
  const resumed = [];
  page.on('request', (request) => request.method() === 'PATCH' && resumed.push(Number(request.headers()['upload-offset'])));
  await page.setInputFiles('#files', file);
  await page.getByRole('button', { name: 'fit strands.hair' }).waitFor();
  assert.equal(resumed[0], 16 << 20, 'it goes on where it stood');
  await page.getByText(/has arrived/).waitFor({ state: 'detached' });
});

test('cameras of the capture go into the fit and stand in the picture', { skip, timeout: 300000 }, async (t) => {
  const daemon = await startDaemon(t), folder = sample(t), page = await startBrowser(t, daemon);
  await page.goto(daemon.url);
  await page.setInputFiles('#files', [join(folder, 'strands.hair'), join(folder, 'head.obj')]);
  await page.getByRole('button', { name: 'fit strands.hair' }).waitFor();
  await page.getByText('cameras of the capture').click();
  await t.test('one of COLMAP’s two files is not enough', async () => {
    writeFileSync(join(folder, 'cameras.txt'), '1 PINHOLE 640 480 500 500 320 240\n');
    await page.getByLabel('Cameras for visibility').setInputFiles(join(folder, 'cameras.txt'));
    await page.locator('#notices p').filter({ hasText: 'images.txt' }).waitFor();
  });
  await page.getByLabel('Cameras for visibility').setInputFiles(join(folder, 'cameras.json'));
  await page.getByText(/^\d+ cameras$/).waitFor();
  await page.getByLabel('Quality').selectOption('draft');
  await page.getByRole('button', { name: 'fit strands.hair' }).click();
  await page.getByRole('link', { name: 'Open the groom' }).click();
  await settled(page, 1);
  await page.getByLabel(/the capture’s \d+ cameras/).check();
  assert.ok(await page.evaluate(() => window.studio.viewer.cameras.children[0].geometry.getAttribute('position').count) >= 16);
  await t.test('colour by distance to the target follows the hair', async () => {
    await page.waitForFunction(() => window.studio.viewer.target.count > 0);
    await page.getByLabel('colour by').selectOption('distance');
    await page.locator('.legend').getByText(/mm/).waitFor();
    await page.waitForTimeout(300);
    await picture(page, 'studio-distance');
  });
});

test('colours, revisions side by side, and a sample that is fair', { skip, timeout: 300000 }, async (t) => {
  const daemon = await startDaemon(t), folder = sample(t, '--strands', '1000'), page = await startBrowser(t, daemon);
  const groom = await imported(daemon, folder);
  await page.goto(`${daemon.url}/#/grooms/${groom}`);
  await settled(page, 1);
  await page.waitForFunction(() => window.studio.evaluation.lit);
  await page.waitForTimeout(300);
  const hair = await fields(page);
  for (const [by, words] of [['radius', /mm/], ['hand', /left.*straight.*right/], ['beta', /wave/]])
    await t.test(`coloured by ${by}`, async () => {
      await page.getByLabel('colour by').selectOption(by);
      await page.locator('.legend').filter({ hasText: words }).waitFor();
      await page.waitForTimeout(300);
      await picture(page, `studio-colour-${by}`);
      assert.ok(apart(hair, await fields(page)) > 3);
      const [value, daemons] = await page.evaluate(async (column) => {
        const { session, viewer } = window.studio, { count, document: { strands: { vertices } } } = session;
        const table = new Float32Array(await (await fetch(`${session.at}/analysis?format=binary&count=${count}`)).arrayBuffer());
        return [viewer.groom.values[session.slotOf[17] * vertices + 9], table[4 * (17 * vertices + 9) + column]];
      }, { radius: 0, hand: 2, beta: 3 }[by]);
      if (by === 'radius') assert.ok(daemons === 0 ? Number.isNaN(value) : Math.abs(Math.exp(value) / daemons - 1) < 1e-5);
      else assert.equal(value, daemons);
    });
  await page.getByLabel('colour by').selectOption('none');
  await t.test('an operator is reset to what the first revision has', async () => {
    const curl = await page.evaluate(() => window.studio.session.operators.findIndex((o) => o.type === 'curl'));
    const before = await shown(page);
    await page.evaluate(async (index) => {
      await window.studio.session.turn(index, 'radius', 0.02);
      await window.studio.session.settle(index, 'radius');
    }, curl);
    await settled(page, 2);
    assert.notDeepEqual(await shown(page), before);
    await page.getByLabel('reset: curl').click();
    await settled(page, 3);
    assert.deepEqual(await shown(page), before);
  });
  await t.test('revision 2 stands beside revision 3', async () => {
    await page.getByLabel('Revision 2 beside it').click();
    await page.getByText('with revision 2').waitFor();
    await page.waitForTimeout(300);
    await picture(page, 'studio-revisions');
    assert.equal(await page.evaluate(() => window.studio.viewer.comparison), 'side by side');
    const moved = await page.evaluate(() => {
      const { evaluation: { strands: a }, viewer: { target: b } } = window.studio;
      return [a.count === b.count, a.points.some((x, i) => Math.abs(x - b.held[i]) > 1e-3)];
    });
    assert.deepEqual(moved, [true, true]);
  });
  await t.test('fewer strands fill the same room', async () => {
    await page.getByLabel('compare').selectOption('groom');
    const [all, few] = await page.evaluate(() => {
      const { points, vertices, count } = window.studio.evaluation.strands;
      const middle = (n) => [0, 1, 2].map((c) => { let s = 0; for (let i = 0; i < n * vertices; i++) s += points[3 + 3 * i + c]; return s / (n * vertices); });
      return [middle(count), middle(Math.round(count / 10))];
    });
    all.forEach((x, c) => assert.ok(Math.abs(x - few[c]) < 0.02, `${all} ${few}`));
    assert.ok(await drawn(page) > 0.05);
  });
});
