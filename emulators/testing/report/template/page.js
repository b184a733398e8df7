"use strict";
(() => {
  const all = (selector, from = document) => [...from.querySelectorAll(selector)];
  const by = id => document.getElementById(id);
  const tests = all("details.test");

  const theme = by("theme");
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const isDark = () => (document.documentElement.dataset.theme || (dark.matches ? "dark" : "light")) === "dark";
  const nameTheme = () => { theme.textContent = isDark() ? "Light" : "Dark"; };
  theme.setAttribute("aria-label", "Switch between light and dark");
  theme.hidden = false;
  theme.addEventListener("click", () => {
    document.documentElement.dataset.theme = isDark() ? "light" : "dark";
    nameTheme();
  });
  dark.addEventListener("change", nameTheme);
  nameTheme();

  const filters = by("filters");
  const wordsOf = new Map();
  const words = test => {
    if (!wordsOf.has(test)) {
      const parts = all("summary .title, .reason, dd", test).map(part => part.textContent);
      wordsOf.set(test, parts.join("\n").toLowerCase());
    }
    return wordsOf.get(test);
  };
  const apply = () => {
    const chosen = new FormData(filters);
    const outcomes = new Set(chosen.getAll("outcome"));
    const requirement = chosen.get("requirement") || "";
    const text = (chosen.get("text") || "").trim().toLowerCase();
    let found = 0;
    for (const test of tests) {
      const fits = outcomes.has(test.dataset.outcome)
        && (!requirement || (test.dataset.requirements || "").split("\n").includes(requirement))
        && (!text || words(test).includes(text));
      test.hidden = !fits;
      found += fits;
    }
    for (const file of all("section.file")) file.hidden = !file.querySelector("details.test:not([hidden])");
    by("found").textContent = found === tests.length ? `${found} shown` : `${found} of ${tests.length} shown`;
    by("none").hidden = found > 0;
  };
  if (filters) {
    filters.hidden = false;
    filters.addEventListener("input", apply);
    filters.addEventListener("submit", event => event.preventDefault());
    by("unfold").addEventListener("click", event => {
      const open = event.target.textContent === "Unfold all";
      for (const test of tests) if (!test.hidden) test.open = open;
      event.target.textContent = open ? "Fold all" : "Unfold all";
    });
    apply();
  }

  const reveal = () => {
    const target = by(decodeURIComponent(location.hash.slice(1)));
    if (!target || !target.matches("details.test")) return;
    if (target.hidden) { filters.reset(); apply(); }
    target.open = true;
    target.scrollIntoView();
  };
  addEventListener("hashchange", reveal);
  reveal();
  document.addEventListener("click", event => {
    const link = event.target.closest('a[href^="#t-"]');
    if (link && link.hash === location.hash) reveal();
  });

  for (const tool of all(".tools, button[data-copy]")) tool.hidden = false;
  const said = (button, text) => {
    const before = button.textContent;
    button.textContent = text;
    setTimeout(() => { button.textContent = before; }, 1500);
  };
  const copied = async (node, button) => {
    try {
      await navigator.clipboard.writeText(node.textContent);
      said(button, "Copied");
    } catch {
      getSelection().selectAllChildren(node);
      said(button, document.execCommand("copy") ? "Copied" : "Selected");
    }
  };
  document.addEventListener("click", event => {
    const button = event.target.closest("button[data-copy], button[data-save]");
    if (!button) return;
    const node = button.closest("dd, details").querySelector("code, pre");
    if ("copy" in button.dataset) { copied(node, button); return; }
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([node.textContent], { type: "text/plain" }));
    link.download = button.dataset.save;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  });

  const pointsOf = path => {
    const points = [];
    let x = 0, y = 0;
    for (const [, verb, first, second] of path.getAttribute("d").matchAll(/([MLHV])([-\d.e+]+)(?: ([-\d.e+]+))?/g)) {
      if (verb === "V") y = +first; else x = +first;
      if (second !== undefined) y = +second;
      points.push([x, y]);
    }
    return points;
  };
  const curveAt = (lane, part) => {
    lane.points ||= pointsOf(lane.querySelector("path"));
    const next = lane.points.findIndex(point => point[0] > part * 10);
    const [x0, y0] = lane.points.at(next < 0 ? -1 : Math.max(0, next - 1));
    const [x1, y1] = lane.points.at(next);
    const y = x1 > x0 ? y0 + (y1 - y0) * Math.max(0, part * 10 - x0) / (x1 - x0) : y0;
    const { low, high } = lane.dataset;
    return String(Number((+high - (high - low) * y / 100).toPrecision(4)));
  };
  const wordAt = (lane, part) => {
    const at = all(".word", lane).filter(word => parseFloat(word.getAttribute("x")) <= part).pop();
    return at ? at.querySelector("title").textContent : "";
  };
  document.addEventListener("pointermove", event => {
    const figure = event.target.closest?.(".timeline");
    if (!figure) return;
    const box = figure.querySelector(".plot").getBoundingClientRect();
    const part = Math.min(100, Math.max(0, (event.clientX - box.left) / box.width * 100));
    const { from, to } = figure.dataset;
    for (const lane of all(".lane", figure)) {
      const plot = lane.querySelector(".plot");
      let line = plot.querySelector(":scope > .cursor");
      if (!line) {
        line = document.createElementNS(plot.namespaceURI, "line");
        line.setAttribute("class", "cursor");
        line.setAttribute("y2", "100%");
        plot.append(line);
      }
      line.setAttribute("x1", `${part}%`);
      line.setAttribute("x2", `${part}%`);
      const output = lane.querySelector("output");
      if (lane.dataset.low !== undefined) output.textContent = curveAt(lane, part);
      else if (lane.dataset.name !== undefined) output.textContent = wordAt(lane, part);
      else if (lane.matches(".axis")) output.textContent = `${((+from + (to - from) * part / 100) / 1e6).toFixed(6)} s`;
    }
  });

  addEventListener("beforeprint", () => {
    for (const test of tests) if (!["passed", "skipped"].includes(test.dataset.outcome)) test.open = true;
  });
})();
