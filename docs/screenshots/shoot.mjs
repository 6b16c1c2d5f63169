// Pictures of pages: node shoot.mjs OUT [--dark] [--wait SECONDS] [--width PIXELS] [--height PIXELS] PAGE...
// A page is a file or an address, its picture is as high as the page, or --height.  NAME=PAGE names the picture. Says for each what its scripts complained of, what it asked the network for,
// formulas that are not drawn and tables that are cut.  Exit status 1 if there was any such thing.
import chromium from '@sparticuz/chromium';
import puppeteer from 'puppeteer-core';
import fs from 'fs';
import path from 'path';

const given = process.argv.slice(2);
const take = (name, fallback) => {
  const at = given.indexOf(name);
  return at < 0 ? fallback : Number(given.splice(at, 2)[1]);
};
const dark = given.includes('--dark');
if (dark) given.splice(given.indexOf('--dark'), 1);
const wait = take('--wait', 0.5), width = take('--width', 1280), fixed = take('--height', 0);
const [out, ...pages] = given;

const browser = await puppeteer.launch({
  args: ['--lang=en-US', ...chromium.args, '--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader',
    '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist', '--allow-file-access-from-files'],
  executablePath: process.env.CHROMIUM ?? await chromium.executablePath(), headless: 'shell',
  protocolTimeout: 300000, env: { ...process.env, LANG: 'en_US.UTF-8', LC_ALL: 'en_US.UTF-8' },
});
let problems = 0;
fs.mkdirSync(out, { recursive: true });
for (const item of pages) {
  const [, named, given] = /^(?:([\w-]+)=)?(.*)$/.exec(item);
  const address = /^https?:/.test(given) ? given : 'file://' + path.resolve(given);
  const said = [], page = await browser.newPage();
  page.on('console', m => m.type() === 'error' && said.push(m.text()));
  page.on('pageerror', e => said.push(e.message));
  page.on('request', r => {
    if (/^https?:/.test(r.url()) && new URL(r.url()).host !== new URL(address).host) said.push('asks for ' + r.url());
  });
  await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: dark ? 'dark' : 'light' }]);
  await page.setViewport({ width, height: fixed || 900 });
  await page.goto(address, { waitUntil: 'load' });
  await new Promise(done => setTimeout(done, 1000 * wait));
  said.push(...await page.evaluate(() => [
    ...[...document.querySelectorAll('.arithmatex, math merror')].map(e => 'not drawn: ' + e.textContent.slice(0, 60)),
    ...[...document.querySelectorAll('table')].filter(e => {
      let box = e;
      while (box && box !== document.body) {
        if (/auto|scroll/.test(getComputedStyle(box).overflowX)) return false;
        box = box.parentElement;
      }
      return e.getBoundingClientRect().right > innerWidth;
    }).map(e => 'cut table: ' + e.textContent.trim().slice(0, 40)),
  ]));
  // That pictures are drawn in software is so of this browser alone.
  await page.evaluate(() => document.querySelectorAll('.mantine-Notification-root').forEach(e => e.remove()));
  const height = await page.evaluate(() => document.documentElement.scrollHeight);
  if (!fixed) await page.setViewport({ width, height: Math.min(height, 4000) });
  const name = named || path.basename(new URL(address).pathname).replace(/\.html$/, '') || 'page';
  await page.screenshot({ path: path.join(out, name + (dark ? '-dark' : '') + '.png') });
  console.log(name + (said.length ? '\n  ' + [...new Set(said)].join('\n  ') : ': as it should be'));
  problems += said.length;
  if (pages.length > 1) await page.close();
}
browser.process()?.kill('SIGKILL');  // to close it takes minutes while it draws in software
process.exit(problems ? 1 : 0);
