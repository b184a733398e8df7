"use strict";
// The data is text of strangers: it reaches the page by textContent and setAttribute of numbers alone.
const data = JSON.parse(document.getElementById("data").textContent);
const at = id => document.getElementById(id);
const SVG = "http://www.w3.org/2000/svg";
const NMT = ["operational", "pre-operational", "stopped"];
const state = {from: 0, to: Math.max(data.span, 1), node: "", words: "", chosen: -1, cross: null, paper: false};
const shownSignals = new Set(data.signals.map((_, number) => number).filter(number => number < 10));
let drawn = {lanes: [], left: 0, width: 0, height: 0};

const make = (tag, text, kind) => {
  const one = document.createElement(tag);
  if (text !== undefined) one.textContent = text;
  if (kind) one.className = kind;
  return one;
};
const draw = (parent, tag, values, text) => {
  const one = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(values)) one.setAttribute(name, value);
  if (text !== undefined) one.textContent = text;
  parent.append(one);
  return one;
};
const seconds = us => {
  const digits = state.to - state.from < 2e4 ? 6 : state.to - state.from < 2e7 ? 4 : 3;
  return (us / 1e6).toFixed(digits) + " s";
};
const short = number => {
  if (Math.abs(number) >= 1e6 || (number && Math.abs(number) < 1e-3)) return number.toPrecision(4);
  return String(Number(number.toFixed(3)));
};
const fits = text => !state.words || text.toLowerCase().includes(state.words);
const wordsOf = finding => `${finding.title} ${finding.rule} ${finding.text}`;
const ofNode = one => !state.node || one.key === state.node;

// Findings.

function listFindings() {
  const list = at("finding-list");
  list.textContent = "";
  const seen = data.findings.map((one, number) => [one, number])
    .filter(([one]) => ofNode(one) && fits(wordsOf(one)));
  for (const [one, number] of seen) {
    const item = make("li"), button = make("button", undefined, "finding"), open = number === state.chosen;
    button.dataset.finding = number;
    button.setAttribute("aria-expanded", String(open));
    const head = make("span", undefined, "head"), texts = make("span", undefined, "texts");
    head.append(make("span", one.title, "title"), " ", make("span", one.rule, "rule"));
    texts.append(head, make("span", one.count > 1 ? `${one.text} (${one.count} times)` : one.text, "words"));
    button.append(make("time", (one.t / 1e6).toFixed(6) + " s"), texts,
      make("span", `${open ? "hide" : "show"} ${one.frames.length ? "frames" : "more"}`, "open"));
    button.addEventListener("click", () => choose(number === state.chosen ? -1 : number, false));
    item.append(button);
    if (state.paper) item.append(...fewFrames(one));
    else if (open) item.append(framesOf(one));
    list.append(item);
  }
  if (!seen.length) list.append(make("li", data.findings.length ? "No finding fits." : "No finding.", "empty"));
  at("shown").textContent = data.findings.length ? `${seen.length} of ${data.findings.length}` : "";
}

function framesOf(finding) {
  const box = make("div", undefined, "frames");
  const where = make("button", "Show in the timeline");
  where.addEventListener("click", () => { near(finding.t); at("timeline").scrollIntoView(); });
  box.append(where);
  if (!finding.frames.length) {
    box.append(make("p", data.around ? "Frames around it are shown for the first findings only." : "", "quiet"));
    return box;
  }
  box.append(frameTable(finding.frames));
  return box;
}

// On paper, where nobody clicks: the first frame of the finding among ten.
function fewFrames(finding) {
  if (!finding.frames.length) return [];
  const first = Math.max(0, finding.frames.findIndex(one => one[4]) - 4);
  const box = make("div", undefined, "frames");
  box.append(frameTable(finding.frames.slice(first, first + 10)));
  return [box];
}

function frameTable(frames) {
  const table = make("table");
  table.setAttribute("aria-label", "Frames around the finding");
  for (const [t, channel, frame, text, here] of frames) {
    const row = make("tr", undefined, here ? "here" : "");
    row.append(make("td", (t / 1e6).toFixed(6)), make("td", channel), make("td", frame), make("td", text));
    table.append(row);
  }
  return table;
}

function choose(number, scroll) {
  state.chosen = number;
  if (number >= 0) {
    const t = data.findings[number].t;
    if (t < state.from || t > state.to) move(t - (state.to - state.from) / 2 - state.from);
  }
  listFindings();
  redraw();
  const button = document.querySelector(`[data-finding="${number}"]`);
  if (!button) return;
  button.focus({preventScroll: !scroll});
  if (scroll) button.scrollIntoView({block: "center"});
}

function step(by) {
  const seen = [...document.querySelectorAll("[data-finding]")].map(one => Number(one.dataset.finding));
  if (!seen.length) return;
  const place = seen.indexOf(state.chosen);
  const next = place < 0 ? (by > 0 ? 0 : seen.length - 1) : (place + by + seen.length) % seen.length;
  choose(seen[next], true);
}

// What is seen of the time.

function view(from, to) {
  const span = Math.min(Math.max(to - from, 10), Math.max(data.span, 10) * 1.02);
  state.from = Math.min(Math.max(from, -data.span * 0.01), Math.max(data.span * 1.01 - span, -data.span * 0.01));
  state.to = state.from + span;
  redraw();
}
const all = () => view(0, Math.max(data.span, 10));
const move = by => view(state.from + by, state.to + by);
function zoom(factor, about) {
  const middle = about === undefined ? (state.from + state.to) / 2 : about;
  view(middle - (middle - state.from) / factor, middle + (state.to - middle) / factor);
}
const near = t => view(t - data.span / 100, t + data.span / 100);

// The chart.

// A finding of many times is a bar from its first to its last, below the marks of the others.
const MANY = 3, MOST_BARS = 6;
const isMany = one => one.at.length > MANY;
function barsOf() {
  const rows = [];
  data.findings.forEach((one, number) => {
    if (!ofNode(one) || !isMany(one)) return;
    const row = rows.find(bars => bars.at(-1).to < one.t);
    const bar = {number, one, from: one.t, to: Math.max(one.last, one.at.at(-1))};
    if (row) row.push(bar); else rows.push([bar]);
  });
  return rows;
}

const SIGNAL_HEIGHTS = {states: 26, constant: 16, curve: 56};
const isConstant = signal => signal.at.length > 0 && signal.at.every((value, n) => n % 3 === 0 || value === signal.at[1]);

function lanesOf() {
  const lanes = [];
  if (data.findings.length) {
    const bars = barsOf();
    lanes.push({kind: "findings", name: "Findings", bars, height: 22 + 7 * Math.min(bars.length, MOST_BARS)});
  }
  for (const bus of data.buses) {
    const several = data.buses.length > 1 ? ` ${bus.name}` : "";
    lanes.push({kind: "load", name: `Load${several}`, soft: "", bus, height: 48});
    if (bus.errors.at.length) lanes.push({kind: "errors", name: `Errors${several}`, soft: "", bus, height: 30});
  }
  for (const node of data.nodes) {
    if (ofNode(node)) lanes.push({kind: "node", name: node.label, soft: node.short, node, height: 62});
  }
  data.signals.forEach((signal, number) => {
    if (!ofNode(signal) || !shownSignals.has(number)) return;
    const kind = signal.states ? "states" : isConstant(signal) ? "constant" : "curve";
    lanes.push({kind, name: signal.name, soft: "", signal, height: SIGNAL_HEIGHTS[kind]});
  });
  return lanes;
}

function redraw() {
  const chart = at("chart"), total = Math.max(chart.clientWidth, 280);
  const left = total < 560 ? 96 : total < 900 ? 150 : 210, width = total - left - 4;
  const lanes = lanesOf();
  const height = lanes.reduce((sum, lane) => sum + lane.height + 4, 0) + 24;
  const old = chart.querySelector("svg");
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", `0 0 ${total} ${height}`);
  const clip = draw(draw(svg, "defs", {}), "clipPath", {id: "inside"});
  draw(clip, "rect", {x: left, y: 0, width, height});
  drawn = {lanes, left, width, height, svg};
  const x = t => left + (t - state.from) / (state.to - state.from) * width;
  ticks(svg, x, left, width, height);
  let y = 20;
  for (const lane of lanes) {
    lane.top = y;
    draw(svg, "path", {class: "lane", d: `M0 ${y - 2}H${total}`});
    label(svg, lane, left, y);
    const inside = draw(svg, "g", {"clip-path": "url(#inside)"});
    painters[lane.kind](inside, lane, x, y);
    y += lane.height + 4;
  }
  const chosen = data.findings[state.chosen];
  if (chosen) draw(svg, "path", {class: "chosen", d: `M${x(chosen.t)} 18V${height}`, "clip-path": "url(#inside)"});
  if (old) old.replaceWith(svg); else chart.append(svg);
  at("span").textContent = `${seconds(Math.max(state.from, 0))} to ${seconds(state.to)}`;
}

function label(svg, lane, left, y) {
  const most = Math.floor((left - 8) / 6.6);
  const cut = text => text.length > most ? text.slice(0, most - 1) + "…" : text;
  const name = draw(svg, "text", {class: "name", x: 0, y: y + 12}, cut(lane.name));
  draw(name, "title", {}, lane.name);
  if (lane.soft) draw(svg, "text", {class: "soft", x: 0, y: y + 25}, cut(lane.soft));
}

function ticks(svg, x, left, width, height) {
  const span = (state.to - state.from) / 1e6, most = Math.max(2, Math.floor(width / 90));
  const power = 10 ** Math.floor(Math.log10(span / most));
  const width10 = [1, 2, 5, 10].map(factor => factor * power).find(one => span / one <= most) || 10 * power;
  const digits = Math.max(0, -Math.floor(Math.log10(width10)));
  for (let n = Math.ceil(state.from / 1e6 / width10); n * width10 <= state.to / 1e6; n++) {
    const place = x(n * width10 * 1e6);
    if (place < left - 1) continue;
    draw(svg, "path", {class: "tick", d: `M${place} 14V${height}`});
    const anchor = place > left + width - 30 ? "end" : place < left + 20 ? "start" : "middle";
    draw(svg, "text", {class: "soft", x: place, y: 10, "text-anchor": anchor}, (n * width10).toFixed(digits) + " s");
  }
}

// Bins that are seen: their first place in the list, and one behind the last.
function seenBins(bins, size) {
  const first = Math.floor(state.from / bins.width) - 1, last = Math.ceil(state.to / bins.width) + 1;
  let from = 0;
  while (from < bins.at.length && bins.at[from] < first) from += size;
  let to = from;
  while (to < bins.at.length && bins.at[to] <= last) to += size;
  return [from, to];
}

function area(group, kind, bins, x, top, height, most) {
  const [from, to] = seenBins(bins, 2);
  let path = "", end = null, high = 0;
  let column = null;
  const flush = () => { if (column !== null) path += `M${column[0].toFixed(1)} ${top + height}V${(top + height - column[2] / most * height).toFixed(1)}H${column[1].toFixed(1)}V${top + height}Z`; };
  for (let n = from; n < to; n += 2) {
    const begin = x(bins.at[n] * bins.width), stop = Math.max(x((bins.at[n] + 1) * bins.width), begin + 0.8);
    if (column && begin - column[0] < 1) {
      column[1] = stop; column[2] = Math.max(column[2], bins.at[n + 1]);
    } else {
      flush();
      column = [begin, stop, bins.at[n + 1]];
    }
  }
  flush();
  if (path) draw(group, "path", {class: kind, d: path});
}

const highest = bins => {
  let most = 1;
  for (let n = 1; n < bins.at.length; n += 2) most = Math.max(most, bins.at[n]);
  return most;
};
const perSecond = bins => 1e6 / bins.width;

// Draws states, and returns what writes their names: above what is drawn meanwhile.
function bands(group, changes, x, top, height, end, classOf) {
  let before = -10;
  const words = [];
  for (let n = 0; n < changes.length; n += 2) {
    const from = x(changes[n]), to = x(n + 2 < changes.length ? changes[n + 2] : end);
    if (to < drawn.left || from > drawn.left + drawn.width) continue;
    if (to - before < 0.4) continue;
    before = to;
    const begin = Math.max(from, drawn.left), stop = Math.min(to, drawn.left + drawn.width);
    draw(group, "rect", {class: classOf(changes[n + 1]), x: begin, y: top, width: Math.max(stop - begin, 0.6), height});
    if (stop - begin > changes[n + 1].length * 6 + 6) {
      words.push([begin + 3, changes[n + 1]]);
    }
  }
  return () => { for (const [left, text] of words) draw(group, "text", {class: "in", x: left, y: top + height - 3}, text); };
}

function marks(group, kind, list, x, shape) {
  let path = "", dim = "", before = -10;
  for (const [t, , text] of list) {
    const place = x(t);
    if (place < drawn.left - 6 || place > drawn.left + drawn.width + 6 || place - before < 1.5) continue;
    before = place;
    if (state.words && !fits(text)) dim += shape(place); else path += shape(place);
  }
  if (path) draw(group, "path", {class: kind, d: path});
  if (dim) draw(group, "path", {class: `${kind} dim`, d: dim});
}

// A state has one colour in all signals, so that the legend can say which.
const stateNames = [...new Set(data.signals.flatMap(one => (one.states || []).filter((_, n) => n % 2)))];
const STATE_COLOURS = 6, MOST_STATES = 12;
const plainNames = stateNames.filter(name => name !== "operation enabled" && !name.startsWith("fault"));
const stateClass = name => name === "operation enabled" ? "operational" : name.startsWith("fault") ? "stopped" : `s${plainNames.indexOf(name) % STATE_COLOURS}`;
const nmtClass = name => NMT.includes(name) ? name : "other";
const painters = {
  findings(group, lane, x, y) {
    const mark = (one, number, kind, d) => {
      const found = draw(group, "path", {class: fits(wordsOf(one)) ? kind : `${kind} dim`, d});
      found.dataset.mark = number;
    };
    lane.bars.forEach((bars, row) => {
      const top = y + 18 + 7 * (row % MOST_BARS);
      for (const {number, one, from, to} of bars) {
        const begin = Math.max(x(from), drawn.left - 2), end = Math.min(Math.max(x(to), x(from) + 3), drawn.left + drawn.width + 2);
        if (end > begin) mark(one, number, "found many", `M${begin} ${top}H${end}v5H${begin}z`);
      }
    });
    data.findings.forEach((one, number) => {
      if (!ofNode(one) || isMany(one)) return;
      let path = "", before = -10;
      for (const t of one.at.length ? one.at : [one.t]) {
        const place = x(t);
        if (place < drawn.left - 5 || place > drawn.left + drawn.width + 5 || place - before < 2) continue;
        before = place;
        path += `M${place - 5} ${y + 3}h10l-5 12z`;
      }
      if (path) mark(one, number, "found", path);
    });
  },
  load(group, lane, x, y) {
    const bins = lane.bus.load, most = highest(bins), scale = perSecond(bins);
    area(group, "area", bins, x, y + 2, lane.height - 2, most);
    const text = lane.bus.rate ? `max ${(most * scale / lane.bus.rate * 100).toFixed(1)} %` : `max ${(most * scale / 1e3).toFixed(1)} kbit/s`;
    draw(drawn.svg, "text", {class: "soft", x: 0, y: y + 25}, text);
    draw(drawn.svg, "text", {class: "soft", x: 0, y: y + 38}, `in ${short(bins.width / 1e3)} ms`);
  },
  errors(group, lane, x, y) {
    area(group, "errors", lane.bus.errors, x, y + 2, lane.height - 2, highest(lane.bus.errors));
  },
  node(group, lane, x, y) {
    const node = lane.node;
    const write = bands(group, node.states, x, y + 1, 14, data.span, nmtClass);
    for (const [t, span] of node.gaps) {
      const from = Math.max(x(t), drawn.left - 2), to = Math.min(x(t + span), drawn.left + drawn.width + 2);
      if (to > from) draw(group, "rect", {class: "gap", x: from, y: y + 1, width: Math.max(to - from, 2), height: 14});
    }
    write();
    marks(group, "command", node.commands, x, place => `M${place} ${y + 17}v10`);
    marks(group, "boot", node.boots, x, place => `M${place - 4} ${y + 27}h8l-4 -9z`);
    marks(group, "emcy", node.emcys, x, place => `M${place} ${y + 16}l5 6l-5 6l-5 -6z`);
    marks(group, "failed", node.failures, x, place => `M${place - 4} ${y + 18}l8 8m0 -8l-8 8`);
    let bars = "", before = -10;
    for (const [t, span] of node.transfers) {
      const from = x(t), to = Math.max(x(t + span), from + 1);
      if (to < drawn.left || from > drawn.left + drawn.width || from - before < 0.8) continue;
      before = from;
      bars += `M${from.toFixed(1)} ${y + 30}H${to.toFixed(1)}v6H${from.toFixed(1)}z`;
    }
    if (bars) draw(group, "path", {class: "sdo", d: bars});
    area(group, "area", node.pdos, x, y + 38, lane.height - 38, highest(node.pdos));
  },
  states(group, lane, x, y) {
    bands(group, lane.signal.states, x, y + 2, lane.height - 6, data.span, stateClass)();
  },
  constant(group, lane, x, y) {
    const text = `always ${short(lane.signal.at[1])} ${lane.signal.unit}`;
    draw(group, "text", {class: "soft", x: drawn.left + 3, y: y + 12}, text);
  },
  curve(group, lane, x, y) {
    const bins = lane.signal, [from, to] = seenBins(bins, 3);
    let low = Infinity, high = -Infinity;
    for (let n = from; n < to; n += 3) { low = Math.min(low, bins.at[n + 1]); high = Math.max(high, bins.at[n + 2]); }
    if (low > high) return;
    const flat = high === low, room = lane.height - 6;
    const row = value => y + 2 + (flat ? room / 2 : (high - value) / (high - low) * room);
    let path = "", begun = false, column = null;
    const flush = () => {
      if (!column) return;
      path += `${begun ? "L" : "M"}${column[0].toFixed(1)} ${row(column[1]).toFixed(1)}`;
      if (column[2] !== column[1]) path += `L${column[0].toFixed(1)} ${row(column[2]).toFixed(1)}`;
      begun = true;
    };
    for (let n = from; n < to; n += 3) {
      const place = x((bins.at[n] + 0.5) * bins.width);
      if (column && place - column[0] < 1) {
        column[1] = Math.min(column[1], bins.at[n + 1]); column[2] = Math.max(column[2], bins.at[n + 2]);
      } else {
        flush();
        column = [place, bins.at[n + 1], bins.at[n + 2]];
      }
    }
    flush();
    draw(group, "path", {class: "line", d: path});
    const range = flat ? short(low) : `${short(low)} … ${short(high)}`;
    draw(drawn.svg, "text", {class: "soft", x: 0, y: y + 25}, `${range} ${lane.signal.unit}`);
  },
};

// What lies under the pointer.

const valueAt = (bins, t, size) => {
  const place = Math.floor(t / bins.width);
  for (let n = 0; n < bins.at.length; n += size) if (bins.at[n] === place) return bins.at.slice(n + 1, n + size);
  return null;
};
const stateAt = (changes, t) => {
  let found = "";
  for (let n = 0; n < changes.length && changes[n] <= t; n += 2) found = changes[n + 1];
  return found;
};

function under(lane, t, reach) {
  const lines = [];
  const add = list => {
    const found = list.filter(one => one[0] - reach <= t && t <= one[0] + one[1] + reach);
    for (const one of found.slice(0, 5)) lines.push(`${seconds(one[0])}  ${one[2]}`);
    if (found.length > 5) lines.push(`and ${found.length - 5} more`);
  };
  if (lane.kind === "findings") {
    add(data.findings.filter(ofNode).flatMap(one => (one.at.length ? one.at : [one.t]).map(t => [t, 0, `${one.title} (${one.rule}): ${one.text}`])));
  }
  if (lane.kind === "load") {
    const found = valueAt(lane.bus.load, t, 2), rate = (found ? found[0] : 0) * perSecond(lane.bus.load);
    lines.push(lane.bus.rate ? `${(rate / lane.bus.rate * 100).toFixed(2)} %` : `${(rate / 1e3).toFixed(2)} kbit/s`);
  }
  if (lane.kind === "errors") {
    const found = valueAt(lane.bus.errors, t, 2);
    lines.push(`${found ? found[0] : 0} error frames`);
  }
  if (lane.kind === "node") {
    const node = lane.node, rate = valueAt(node.pdos, t, 2);
    lines.push(stateAt(node.states, t) || "state not told");
    for (const list of [node.gaps, node.boots, node.commands, node.emcys, node.failures, node.transfers]) add(list);
    lines.push(`${((rate ? rate[0] : 0) * perSecond(node.pdos)).toFixed(1)} PDOs/s`);
  }
  if (lane.kind === "states") lines.push(stateAt(lane.signal.states, t));
  if (lane.kind === "curve" || lane.kind === "constant") {
    const found = valueAt(lane.signal, t, 3);
    if (found) lines.push(`${found[0] === found[1] ? short(found[0]) : `${short(found[0])} … ${short(found[1])}`} ${lane.signal.unit}`);
  }
  return lines;
}

function hover(event) {
  const tip = at("tip"), box = drawn.svg.getBoundingClientRect(), scale = drawn.svg.viewBox.baseVal.width / box.width;
  const px = (event.clientX - box.left) * scale, py = (event.clientY - box.top) * scale;
  if (state.cross) state.cross.remove();
  const lane = drawn.lanes.find(one => py >= one.top - 2 && py < one.top + one.height + 2);
  if (px < drawn.left || !lane) { tip.hidden = true; return; }
  const perPixel = (state.to - state.from) / drawn.width, t = state.from + (px - drawn.left) * perPixel;
  state.cross = draw(drawn.svg, "path", {class: "cross", d: `M${px} 16V${drawn.height}`});
  tip.textContent = [`${seconds(t)}  ${lane.name}`, ...under(lane, t, 5 * perPixel)].filter(Boolean).join("\n");
  tip.hidden = false;
  const wide = tip.offsetWidth, high = tip.offsetHeight;
  tip.style.left = Math.max(4, Math.min(event.clientX + 14, innerWidth - wide - 8)) + "px";
  tip.style.top = (event.clientY + 18 + high > innerHeight ? event.clientY - high - 10 : event.clientY + 18) + "px";
}

function pointers() {
  const chart = at("chart");
  let start = null, brush = null;
  const place = event => {
    const box = drawn.svg.getBoundingClientRect();
    return (event.clientX - box.left) * drawn.svg.viewBox.baseVal.width / box.width;
  };
  const timeOf = px => state.from + (px - drawn.left) / drawn.width * (state.to - state.from);
  chart.addEventListener("pointermove", event => {
    hover(event);
    if (start === null) return;
    const px = Math.max(place(event), drawn.left);
    if (!brush) brush = draw(drawn.svg, "rect", {class: "brush", y: 16, height: drawn.height - 16});
    brush.setAttribute("x", Math.min(start, px));
    brush.setAttribute("width", Math.abs(px - start));
  });
  chart.addEventListener("pointerdown", event => {
    hover(event);
    if (event.button === 0 && event.pointerType !== "touch" && place(event) >= drawn.left) start = place(event);
  });
  addEventListener("pointerup", event => {
    if (start === null) return;
    const px = Math.max(place(event), drawn.left), from = timeOf(Math.min(start, px)), to = timeOf(Math.max(start, px));
    const wide = Math.abs(px - start);
    start = null;
    if (brush) brush.remove();
    brush = null;
    if (wide > 6) view(from, to);
  });
  chart.addEventListener("click", event => {
    if (event.target.dataset && event.target.dataset.mark !== undefined) choose(Number(event.target.dataset.mark), true);
  });
  chart.addEventListener("pointerleave", () => { at("tip").hidden = true; if (state.cross) state.cross.remove(); });
  chart.addEventListener("dblclick", all);
  chart.addEventListener("wheel", event => {
    if (!event.ctrlKey) return;
    event.preventDefault();
    zoom(event.deltaY < 0 ? 1.4 : 1 / 1.4, timeOf(place(event)));
  }, {passive: false});
}

// Tables, tools and keys.

function table(id, heads, rows, kinds) {
  const found = at(id), used = heads.map((_, n) => rows.some(cells => cells[n]));
  found.textContent = "";
  const head = make("tr");
  heads.forEach((text, n) => { if (used[n]) head.append(make("th", text, kinds[n] || "")); });
  const top = make("thead"), body = make("tbody");
  top.append(head);
  for (const cells of rows) {
    const row = make("tr");
    cells.forEach((text, n) => {
      if (!used[n]) return;
      const cell = make("td", text, kinds[n] || "");
      cell.dataset.head = heads[n];
      row.append(cell);
    });
    body.append(row);
  }
  found.append(top, body);
}

function tables() {
  const nodes = data.nodes.filter(one => ofNode(one) && fits(one.cells.join(" ")));
  table("node-table", data.nodeHeads, nodes.map(one => one.cells), ["short", "", "long", "short", "short", "", "", "long", "long"]);
  const ids = data.ids.filter(one => ofNode({key: one.key}) && fits(one.cells.join(" ")));
  table("id-table", ["Bus", "CAN-ID", "Frames", "1/s", "Meaning"],
    ids.map(one => data.buses.length > 1 ? one.cells : ["", ...one.cells.slice(1)]), ["short", "mono", "number", "number", "long"]);
  const list = at("signal-list");
  list.textContent = "";
  data.signals.forEach((signal, number) => {
    if (!ofNode(signal) || !fits(signal.name)) return;
    const item = make("li"), label = make("label"), box = make("input");
    box.type = "checkbox";
    box.checked = shownSignals.has(number);
    box.addEventListener("change", () => { if (box.checked) shownSignals.add(number); else shownSignals.delete(number); redraw(); });
    label.append(box, signal.name);
    item.append(label);
    list.append(item);
  });
  at("choice").hidden = !data.signals.length;
}

function refresh() { listFindings(); tables(); redraw(); }

function begin() {
  const select = at("node");
  const none = make("option", "all");
  none.value = "";
  select.append(none);
  for (const node of data.nodes) {
    const one = make("option", node.label);
    one.value = node.key;
    select.append(one);
  }
  select.addEventListener("change", () => { state.node = select.value; refresh(); });
  at("search").addEventListener("input", event => { state.words = event.target.value.trim().toLowerCase(); refresh(); });
  at("in").addEventListener("click", () => zoom(2));
  at("out").addEventListener("click", () => zoom(0.5));
  at("all").addEventListener("click", all);
  at("earlier").addEventListener("click", () => move((state.from - state.to) / 4));
  at("later").addEventListener("click", () => move((state.to - state.from) / 4));
  for (const [kind, sign, text] of [["operational", "", "operational"], ["pre-operational", "", "pre-operational"],
    ["stopped", "", "stopped"], ["gap", "", "no heartbeat"], ["boot", "▲", "boot-up"], ["", "|", "NMT command"],
    ["emcy", "◆", "EMCY"], ["failed", "✕", "SDO failed"], ["", "▬", "SDO transfer"], ["found", "▼", "finding"],
    ...stateNames.slice(0, MOST_STATES).map(name => [stateClass(name), "", name])]) {
    const one = make("span");
    one.append(make("i", sign, kind), text);
    at("legend").append(one);
  }
  at("judged").textContent = data.judged;
  for (const line of data.about) {
    const text = make("p", line[0] + " ");
    if (line[1]) text.append(make("code", line[1]));
    at("about").append(text);
  }
  addEventListener("keydown", event => {
    const typing = ["INPUT", "SELECT"].includes(event.target.tagName) && event.target.type !== "checkbox";
    if (event.key === "Escape") {
      at("search").value = state.words = "";
      event.target.blur();
      choose(-1, false);
      refresh();
    }
    if (typing || event.ctrlKey || event.metaKey || event.altKey) return;
    const inside = document.activeElement === at("chart");
    const act = {"+": () => zoom(2), "=": () => zoom(2), "-": () => zoom(0.5), "0": all, n: () => step(1), p: () => step(-1),
      "/": () => at("search").focus(),
      ArrowLeft: inside && (() => move((state.from - state.to) / 4)), ArrowRight: inside && (() => move((state.to - state.from) / 4))}[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  });
  const paper = matchMedia("print"), print = on => { if (state.paper !== on) { state.paper = on; listFindings(); } };
  paper.addEventListener("change", () => print(paper.matches));
  addEventListener("beforeprint", () => print(true));
  addEventListener("afterprint", () => print(false));
  pointers();
  refresh();
  print(paper.matches);
  new ResizeObserver(() => redraw()).observe(at("chart"));
}
begin();
