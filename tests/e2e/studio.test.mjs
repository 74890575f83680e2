// The studio, as a groomer uses it: upload, fit, turn a knob, undo, take the result home; and what is
// taken home is what was shown.
import test from 'node:test';
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { build, startDaemon } from '../support/daemon.mjs';
import { picture, startBrowser } from '../support/browser.mjs';
import { drawn, imported, sample, settled, shown, skip } from '../support/studio.mjs';

test('from files to a groom, a knob, back, and home', { skip, timeout: 300000 }, async (t) => {
  const daemon = await startDaemon(t), folder = sample(t), page = await startBrowser(t, daemon);
  await page.goto(daemon.url);
  await page.setInputFiles('#files', [join(folder, 'strands.hair'), join(folder, 'head.obj')]);
  await page.getByRole('button', { name: 'fit strands.hair' }).waitFor();
  await page.getByLabel('Head for the fit').selectOption({ label: 'head.obj' });
  await page.getByLabel('Quality').selectOption('draft');
  await page.getByRole('button', { name: 'fit strands.hair' }).click();
  await page.getByRole('link', { name: 'Open the groom' }).click();
  await settled(page, 1);
  await page.waitForFunction(() => window.studio.evaluation.lit && window.studio.viewer.head && window.studio.viewer.target.count);
  await picture(page, 'studio-groom');
  assert.ok(await drawn(page) > 0.1, 'the picture is not empty');

  const before = await shown(page), operators = await page.evaluate(() => window.studio.session.operators.map((o) => o.type));
  const curl = page.locator('.lil-gui .lil-gui').nth(operators.indexOf('curl'));
  await t.test('a knob moves the hair and makes a revision', async () => {
    await curl.locator('input[type=text], input[type=number]').first().fill('14');
    await curl.locator('input[type=text], input[type=number]').first().press('Enter');
    await settled(page, 2);
    assert.notDeepEqual(await shown(page), before);
    const { operators: held } = await (await daemon.fetch(`/v1/grooms/${await page.evaluate(() => window.studio.session.id)}?arrays=false`)).json();
    assert.ok(Math.abs(held.find((o) => o.type === 'curl').radius - 0.014) < 1e-6);
  });
  await t.test('undo brings the strands back, redo the knob', async () => {
    const turned = await shown(page);
    await page.getByRole('button', { name: 'undo' }).click();
    await settled(page, 3);
    assert.deepEqual(await shown(page), before);
    await page.getByRole('button', { name: 'redo' }).click();
    await settled(page, 4);
    assert.deepEqual(await shown(page), turned);
  });
  await t.test('a guide follows the hand, keeps its length, and takes its strands along', async () => {
    const held = await shown(page);
    await page.getByLabel(/^guides/).check();
    const lengths = await page.evaluate(async () => {
      const { editor } = window.studio, length = (p) => {
        let sum = 0;
        for (let i = 3; i < p.length; i += 3) sum += Math.hypot(p[i] - p[i - 3], p[i + 1] - p[i - 2], p[i + 2] - p[i - 1]);
        return sum;
      };
      editor.chosen = 5;
      const before = length(editor.guide), tip = editor.vertices - 1, at = editor.guide.slice(3 * tip);
      const Vector3 = editor.viewer.camera.position.constructor;
      editor.drag(5, tip, new Vector3(at[0] + 0.05, at[1] + 0.03, at[2]));
      await editor.settle();
      return [before, length(editor.guide)];
    });
    await settled(page, 5);
    assert.ok(Math.abs(lengths[1] / lengths[0] - 1) < 1e-4, `${lengths}`);
    assert.notDeepEqual(await shown(page), held);
    await page.getByLabel(/^guides/).uncheck();
  });
  await t.test('and goes where the arrows say, without a mouse', async () => {
    await page.getByLabel(/^guides/).check();
    await page.locator('.picture canvas').focus();
    await page.keyboard.press(']');
    const tip = () => page.evaluate(() => Array.from(window.studio.editor.guide.slice(-3)));
    const from = await tip();
    await page.keyboard.press('ArrowRight');
    await settled(page, 6);
    const to = await tip();
    assert.ok(to[0] - from[0] > 0.001 && to[0] - from[0] < 0.0045, `${from} ${to}`);
    assert.match(await page.locator('#status').textContent(), /guide 1 of|strands/);
    await page.getByLabel(/^guides/).uncheck();
  });
  await t.test('what is downloaded is what is shown', async () => {
    await page.locator('select[name=format]').selectOption('data');
    await page.locator('select[name=unit]').selectOption('m');
    const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('link', { name: 'Download' }).click()]);
    const bytes = readFileSync(await download.path()), points = await shown(page), file = [];
    for (let at = 4; at < bytes.length;) {
      const n = bytes.readInt32LE(at);
      at += 4;
      for (let i = 0; i < 3 * n; i++, at += 4) file.push(bytes.readFloatLE(at));
    }
    assert.deepEqual(file, points);
    assert.match(await page.locator('.line code').first().textContent(), /^curl 'http:.*format=data/);
  });
  await t.test('what was done is listed as lines for a shell', async () => {
    await page.locator('.commands summary').click();
    const listed = await page.locator('.commands code').allTextContents(), server = daemon.url.replaceAll('.', '\\.');
    for (const words of ['upload strands\\.hair', 'upload-head head\\.obj', 'fit str_\\w+ --head head_\\w+ --quality draft', 'set grm_\\w+ /operators/\\d/radius=0\\.014', 'revert grm_\\w+ 1', 'export grm_\\w+ --format data'])
      assert.ok(listed.some((line) => new RegExp(`^groomctl --server ${server} ${words}`).test(line)), `${words}\n${listed.join('\n')}`);
    assert.ok(listed.some((line) => /set-guides grm_/.test(line)));
    assert.equal(listed.filter((line) => line.startsWith('curl')).length * 2, listed.length);
    await picture(page, 'studio-commands');
    await page.locator('.commands summary').click();
  });
  await t.test('the server draws what the page shows', async () => {
    // The link follows the canvas a moment later, so both are read at once, when they agree.
    const agreed = await page.waitForFunction(() => {
      const { href } = document.querySelector('form[aria-label=Picture] a'), { clientWidth, clientHeight } = window.studio.viewer.canvas;
      const [width, height] = new URL(href).searchParams.get('size').split('x');
      return Math.abs(width / height - clientWidth / clientHeight) < 0.01 && { href, sizes: [clientWidth, clientHeight] };
    });
    const { href, sizes } = await agreed.jsonValue();
    const drawing = await daemon.fetch(href), bytes = Buffer.from(await drawing.arrayBuffer());
    assert.equal(drawing.status, 200);
    assert.ok(Math.abs(bytes.readUInt32BE(16) / bytes.readUInt32BE(20) - sizes[0] / sizes[1]) < 0.01, 'the page’s shape');
    writeFileSync(join(build, 'tests/pictures/studio-drawn-by-the-server.png'), bytes);
    await page.locator('select[name=from]').selectOption('turn');
    assert.match(await page.evaluate(() => document.querySelector('form[aria-label=Picture] a').href), /turntable\.png\?frames=36/);
  });
  await t.test('target and groom stand side by side', async () => {
    await page.getByLabel('compare').selectOption('side by side');
    await page.getByLabel(/^guides/).check();
    await page.waitForTimeout(500);
    await picture(page, 'studio-side-by-side');
  });
});

test('ruffle and sculpt: seen under the hand, kept as layers, taken away again', { skip, timeout: 300000 }, async (t) => {
  const daemon = await startDaemon(t), folder = sample(t), page = await startBrowser(t, daemon);
  await page.goto(`${daemon.url}/#/grooms/${await imported(daemon, folder)}`);
  await settled(page, 1);
  const before = await shown(page);
  await t.test('a ruffle is an operator like others', async () => {
    await page.getByLabel('Operator to add').selectOption('ruffle');
    await page.getByRole('button', { name: 'add', exact: true }).click();
    await settled(page, 2);
    assert.notDeepEqual(await shown(page), before);
    const tried = await page.evaluate(async () => {
      const { session, evaluation } = window.studio, at = session.operators.length - 1, now = evaluation.strands.points.slice();
      await session.turn(at, 'rho', 0.9);
      return { differs: evaluation.strands.points.some((x, i) => x !== now[i]), revision: session.revision };
    });
    assert.deepEqual(tried, { differs: true, revision: 2 });
  });
  await t.test('a lock follows its armature', async () => {
    await page.getByRole('button', { name: 'show armature' }).click();
    await page.waitForFunction(() => window.studio.armature.joints.length > 8);
    await page.evaluate(async () => {
      const { armature } = window.studio, tip = armature.joints.find((joint) => joint.at === 1);
      tip.object.position.x += 0.12;
      tip.object.position.y += 0.06;
      await armature.attempt();
    });
    await picture(page, 'studio-sculpt');
    await page.evaluate(() => window.studio.armature.commit());
    await settled(page, 3);
    assert.deepEqual(await page.evaluate(() => window.studio.session.operators.map((o) => o.type).slice(-2)), ['ruffle', 'sculpt']);
  });
  await t.test('without its layers the groom is as it was', async () => {
    for (const [type, revision] of [['sculpt', 4], ['ruffle', 5]]) {
      await page.getByLabel(`remove: ${type}`).click();
      await settled(page, revision);
    }
    assert.deepEqual(await shown(page), before);
  });
});

test('pages pass an accessibility check and fit a narrow window', { skip, timeout: 120000 }, async (t) => {
  const daemon = await startDaemon(t), folder = sample(t), page = await startBrowser(t, daemon);
  const policy = (await daemon.fetch('/')).headers.get('content-security-policy');
  assert.match(policy, /default-src 'none'.*script-src 'self'.*connect-src 'self'/);
  const axe = readFileSync(new URL('../node_modules/axe-core/axe.min.js', import.meta.url), 'utf8');
  for (const [at, ready] of [['/', '.grooms'], [`/#/grooms/${await imported(daemon, folder)}`, '.chain .lil-gui']]) {
    await page.goto(daemon.url + at);
    await page.locator(ready).first().waitFor();
    const violations = await page.evaluate(`${axe};axe.run(document).then((r) => r.violations.map((v) => v.id + ': ' + v.nodes.map((n) => n.html).join(' ')))`);
    assert.deepEqual(violations, [], at);
  }
  await page.getByLabel('colour by').selectOption('beta');
  await page.getByRole('button', { name: 'show armature' }).click();
  await page.locator('.legend').getByText(/wave/).waitFor();
  assert.deepEqual(await page.evaluate(`axe.run(document).then((r) => r.violations.map((v) => v.id))`), [], 'with a legend and an armature');
  await page.setViewportSize({ width: 420, height: 700 });
  for (const at of [null, '/']) {
    if (at) await page.goto(daemon.url + at);
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), 'nothing sticks out to the right');
  }
  await picture(page, 'studio-narrow');
});

test('a file that is none is refused in words', { skip, timeout: 120000 }, async (t) => {
  const daemon = await startDaemon(t), page = await startBrowser(t, daemon);
  await page.goto(daemon.url);
  page.removeAllListeners('console'); /* the refused call itself is told there */
  await page.setInputFiles('#files', { name: 'holiday.jpg', mimeType: 'image/jpeg', buffer: Buffer.from('not hair at all') });
  await page.locator('#notices p').filter({ hasText: /.{20}/ }).waitFor();
});
