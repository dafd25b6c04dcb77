// SPDX-License-Identifier: MIT
// A Chromium that a test drives: a JSON object per line on standard input, {"do": ..., ...}, is answered by one,
// {"value": ...} or {"fault": ...}. Faults of the page itself are in the answer to {"do": "faults"}.
import { createRequire } from "node:module";
import { createInterface } from "node:readline";

const require = createRequire(process.env.BROWSER_MODULES + "/");
const { chromium } = require("playwright-core");
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM,
  args: ["--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"],
});
const faults = [];
let page = null;

const does = {
  async open({ url, width, height, scale, theme }) {
    if (page) await page.context().close();
    const context = await browser.newContext({ viewport: { width, height }, deviceScaleFactor: scale || 1, colorScheme: theme || "dark" });
    page = await context.newPage();
    page.on("pageerror", (e) => faults.push(e.message));
    page.on("console", (m) => m.type() === "error" && !m.text().includes("WebSocket") && faults.push(m.text()));
    page.on("request", (r) => r.url().startsWith(new URL(url).origin + "/") || r.url().startsWith("data:") || faults.push("it loads " + r.url()));
    await page.goto(url);
  },
  eval: ({ code }) => page.evaluate(code),
  click: ({ selector }) => page.click(selector),
  choose: ({ selector, value }) => page.selectOption(selector, value),
  press: ({ selector, key }) => page.press(selector, key),
  key: ({ key }) => page.keyboard.press(key),
  // What a screen reader is told: [{role, name, value, focusable}] of all that is not ignored.
  async tree() {
    const session = await page.context().newCDPSession(page);
    const { nodes } = await session.send("Accessibility.getFullAXTree");
    await session.detach();
    const has = (n, name) => (n.properties || []).some((p) => p.name === name && p.value.value === true);
    return nodes.filter((n) => !n.ignored).map((n) => ({ role: n.role && n.role.value, name: n.name && n.name.value, value: n.value && n.value.value, focusable: has(n, "focusable") }));
  },
  async at({ x, y }) {
    const box = await page.locator("#canvas").boundingBox();
    await page.mouse.click(box.x + x * box.width, box.y + y * box.height);
  },
  shot: ({ path, full }) => page.screenshot({ path, fullPage: !!full, quality: path.endsWith(".jpg") ? 80 : undefined }).then(() => null),
  faults: () => faults,
};

console.log(JSON.stringify({ value: "ready" }));
for await (const line of createInterface({ input: process.stdin })) {
  const said = JSON.parse(line);
  try {
    console.log(JSON.stringify({ value: (await does[said.do](said)) ?? null }));
  } catch (e) {
    console.log(JSON.stringify({ fault: e.message }));
  }
}
await browser.close();
