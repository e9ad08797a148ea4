"use strict";
const seen = { faults: [] };
addEventListener("error", (event) => seen.faults.push(String(event.message)));
addEventListener("securitypolicyviolation", (event) => seen.faults.push(event.violatedDirective));
const all = (query) => [...document.querySelectorAll(query)];
const one = (query) => document.querySelector(query);
const names = () => all("#rows tr.pick td.name").map((cell) => cell.textContent);
const click = (query) => one(query).click();
const choose = (id, value) => {
  one(id).value = value;
  one(id).dispatchEvent(new Event(id === "#query" ? "input" : "change"));
};
const until = (seen) => new Promise((done) => {
  const look = () => (seen() ? done() : setTimeout(look, 20));
  look();
});
async function drive() {
  seen.first = names();
  seen.winners = one("#winners tbody").textContent;
  seen.changes = one("#changes tbody").textContent;
  seen.places = all("#places svg path").length;
  seen.groups = all("#rows tr.apart").map((line) => line.textContent);
  seen.headings = all("#rows thead th").map((cell) => cell.textContent);
  seen.round = one("#round").textContent;
  seen.intervals = all("#rows tbody svg circle, #rows tbody svg path.dot").length;
  for (const step of ["up", "down", "none"]) {
    click('#rows button[data-sort="controller"]');
    seen[step] = names();
  }
  click('#rows button[data-sort="gap"]');
  seen.sorted = one("th[aria-sort]").textContent;
  click('#rows button[data-sort="rank"]');
  choose("#knows", "nothing");
  seen.nothing = names();
  choose("#knows", "");
  click('#rows button[data-sort="kind"]');
  seen.kinds = names();
  click('#rows button[data-sort="kind"]');
  click('#rows button[data-sort="kind"]');
  choose("#state", "self-reported");
  seen.reported = names();
  choose("#state", "");
  choose("#query", "pi");
  seen.query = names();
  choose("#query", "");
  choose("#track", "short_wrong_model");
  seen.other = names();
  seen.figure = one("#figure").getAttribute("src");
  choose("#track", "short_nominal");
  click('tr[data-row="short_nominal--pid"]');
  await until(() => one(".pictures"));
  seen.address = location.hash;
  seen.charts = all(".pictures svg").length;
  seen.lines = all(".pictures path").map((line) => line.getAttribute("d"));
  seen.words = one(".pictures").textContent;
  seen.again = one("pre.again").textContent;
  seen.bibtex = one("pre.bibtex").textContent;
  seen.detail = one(".detail").textContent;
  seen.raw = one("a.raw").getAttribute("href");
  click('tr[data-row="short_nominal--pid"]');
  seen.closed = all(".detail").length;
  click('tr[data-row="short_nominal--inverse"]');
  await until(() => one(".pictures"));
  seen.hostile = one(".detail").textContent;
  click('tr[data-row="short_nominal--ppo"]');
  await until(() => one(".pictures"));
  seen.learned = one(".detail").textContent;
  click('tr[data-row="short_nominal--zero"]');
  await until(() => one(".traces .note"));
  seen.missing = one(".traces .note").textContent;
  seen.taken = Boolean(one("#taken") || one(".detail img")) || document.title === "taken";
  seen.loaded = all("script, link, img").map((part) => part.src || part.href);
}
drive().catch((fault) => seen.faults.push(String(fault))).finally(() => {
  const result = document.createElement("pre");
  result.id = "result";
  result.textContent = JSON.stringify(seen);
  document.body.append(result);
});
