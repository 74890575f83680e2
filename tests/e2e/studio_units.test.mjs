// A head that came in another unit than its strands: the studio guesses which as soon as it is there, the fit
// that is asked for all the same refuses it in words, and with the right unit all is well.
import test from 'node:test';
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { startDaemon } from '../support/daemon.mjs';
import { picture, startBrowser } from '../support/browser.mjs';
import { sample, skip } from '../support/studio.mjs';

test('a wrong unit of the head is guessed from its size', { skip, timeout: 120000 }, async (t) => {
  const daemon = await startDaemon(t), folder = sample(t, '--vertices', '24'), page = await startBrowser(t, daemon), large = join(folder, 'large.obj');
  writeFileSync(large, readFileSync(join(folder, 'head.obj'), 'utf8').replace(/^v (\S+) (\S+) (\S+)/gm, (_, ...xyz) => `v ${xyz.slice(0, 3).map((x) => 100 * x).join(' ')}`));
  const status = page.locator('#status');
  await page.goto(daemon.url);

  await t.test('when it is uploaded, whatever comes with it', async () => {
    await page.setInputFiles('#files', [large, join(folder, 'strands.hair')]);
    await page.getByRole('button', { name: 'fit strands.hair' }).waitFor();
    const words = await status.textContent();
    assert.match(words, /large\.obj: a head\. The mesh is \d+(\.\d+)? m across in the unit given; in centimetres it would be 0\.\d+ m\. If that is meant, choose centimetres and upload it again\./);
    assert.match(words, /strands\.hair: \d+ strands\.$/, 'the hair is as large as hair is');
    await picture(page, 'studio-unit-guessed');
  });
  await t.test('a fit with it is refused, and names the unit', async () => {
    await page.getByLabel('Quality').selectOption('draft');
    await page.getByRole('button', { name: 'fit strands.hair' }).click();
    await page.getByText(/the head is not in the strands' unit and axis.*but \d+ % would if it were/).first().waitFor();
    await picture(page, 'studio-unit-refused');
  });
  await t.test('in its own unit it is taken without a word', async () => {
    await page.goto(`${daemon.url}/#/`);
    await page.locator('.drop select[name=unit]').selectOption('cm');
    await page.setInputFiles('#files', large);
    await page.waitForFunction(() => /^large\.obj: a head\.$/.test(document.querySelector('#status').textContent));
    const { heads } = await daemon.json('/v1/heads'), size = ({ bbox }) => Math.max(...bbox.max.map((high, k) => high - bbox.min[k]));
    assert.deepEqual(heads.map((h) => h.unit_m).sort(), [0.01, 1]);
    assert.ok(size(heads.find((h) => h.unit_m === 0.01)) < 1);
  });
});
