// The chain in the studio as a thing with an order and a past: operators change places, versions get names, and one is
// gone back to by its name.
import test from 'node:test';
import assert from 'node:assert/strict';
import { startDaemon } from '../support/daemon.mjs';
import { picture, startBrowser } from '../support/browser.mjs';
import { imported, sample, settled, shown, skip } from '../support/studio.mjs';

const types = (page) => page.evaluate(() => window.studio.session.operators.map((o) => o.type));

/** The strands that the daemon holds: all vertices but roots, as shown() has them. */
async function exported(daemon, id) {
  const bytes = Buffer.from(await (await daemon.fetch(`/v1/grooms/${id}/strands?format=data`)).arrayBuffer()), points = [];
  for (let at = 4; at < bytes.length;) {
    const n = bytes.readInt32LE(at);
    at += 4;
    for (let i = 0; i < 3 * n; i++, at += 4) points.push(bytes.readFloatLE(at));
  }
  return points;
}

test('operators change places, versions have names', { skip, timeout: 120000 }, async (t) => {
  const daemon = await startDaemon(t), groom = await imported(daemon, sample(t)), page = await startBrowser(t, daemon, { width: 1100, height: 760 });
  await page.goto(`${daemon.url}/#/grooms/${groom}`);
  await settled(page, 1);
  const chain = await types(page), first = await shown(page), last = chain.length - 1;

  await t.test('a version gets a name', async () => {
    await page.getByLabel('Name of this version').fill('as it came');
    await page.getByRole('button', { name: 'name', exact: true }).click();
    await settled(page, 2);
    await page.getByRole('button', { name: /as it came/ }).waitFor();
    assert.equal(await page.getByLabel('Name of this version').inputValue(), '', 'the field is free for another');
    assert.equal((await daemon.json(`/v1/grooms/${groom}?arrays=false`)).name, 'as it came');
  });
  await t.test('an operator goes before its neighbour, in the page and in the daemon', async () => {
    await page.getByRole('button', { name: `earlier: ${chain[last]}`, exact: true }).click();
    await settled(page, 3);
    const wanted = [...chain.slice(0, -2), chain[last], chain[last - 1]];
    assert.deepEqual(await types(page), wanted);
    assert.deepEqual((await daemon.json(`/v1/grooms/${groom}?arrays=false`)).operators.map((o) => o.type), wanted);
    assert.deepEqual(await page.locator('.lil-gui .lil-gui > .title, .lil-gui .lil-gui > .lil-title').allTextContents(), wanted.map((type, i) => `${i + 1}  ${type}`));
    const moved = await shown(page);
    assert.notDeepEqual(moved, first);
    assert.deepEqual(moved, await exported(daemon, groom));
    await picture(page, 'studio-reordered');
  });
  await t.test('and back behind it: the strands are as they were, to the bit', async () => {
    await page.getByRole('button', { name: `later: ${chain[last]}`, exact: true }).click();
    await settled(page, 4);
    assert.deepEqual(await types(page), chain);
    assert.deepEqual(await shown(page), first);
  });
  await t.test('what stands first or last stays there, and makes no revision', async () => {
    await page.getByRole('button', { name: `earlier: ${chain[0]}`, exact: true }).click();
    await page.getByRole('button', { name: `later: ${chain[last]}`, exact: true }).click();
    await page.waitForTimeout(300);
    await settled(page, 4);
    assert.deepEqual(await types(page), chain);
  });
  await t.test('a name leads back to its version', async () => {
    await page.getByRole('button', { name: `remove: ${chain[last]}`, exact: true }).click();
    await settled(page, 5);
    assert.deepEqual(await types(page), chain.slice(0, -1));
    await page.getByLabel('Name of this version').fill('without the last');
    await page.getByLabel('Name of this version').press('Enter');
    await settled(page, 6);
    await page.getByRole('button', { name: /without the last/ }).waitFor();
    assert.deepEqual(await page.locator('.history li').evaluateAll((items) => items.filter((i) => / – /.test(i.textContent)).map((i) => i.value)), [6, 2], 'a name stands where it was given');
    await picture(page, 'studio-named-versions');
    await page.locator('.history li[value="2"] button').first().click();
    await settled(page, 7);
    assert.deepEqual(await types(page), chain);
    assert.deepEqual(await shown(page), first);
    const { name } = await daemon.json(`/v1/grooms/${groom}?arrays=false`);
    assert.equal(name, 'as it came', 'which brings its name along');
  });
});
