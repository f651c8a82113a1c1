// The touch section of the page: every scene against every algorithm; put, table, figure and the rest
// are the page's own.

const touchColors = { true: "var(--c1)", false: "var(--c0)" }; // as printed or not

function touchPlot(parent, points, xTitle, yTitle) {
  const svg = draw(parent, "svg", { viewBox: "0 0 400 300", role: "img", "aria-label": yTitle });
  const box = { left: 52, right: 392, top: 20, bottom: 262 };
  const axes = plotAxes(svg, box, points.map(p => p.x), points.map(p => p.y), xTitle, yTitle);
  // Where names and marks stand, so that no name covers another.
  const taken = points.map(p => ({ x: axes.x(p.x) - 6, y: axes.y(p.y) + 4, width: 12 }));
  for (const p of [...points].sort((a, b) => a.x - b.x)) {
    const x = axes.x(p.x), y = axes.y(p.y), color = touchColors[p.printed];
    mark(svg, p.printed ? "triangle" : "circle", x, y, color, false, `${p.name}\n${figure(p.x)}, ${figure(p.y)}`);
    // Beside its mark, or as near below or above it as no other name or mark stands.
    const width = 5.4 * p.name.length, left = x + 8 + width > box.right;
    const at = left ? x - 8 - width : x + 8;
    const covered = line => line > box.bottom - 2 || line < box.top + 8 ||
      taken.some(t => Math.abs(t.y - line) < 11 && at < t.x + t.width && t.x < at + width);
    let line = y + 4;
    for (let k = 1; covered(line) && k < 24; ++k) line = y + 4 + 6 * (k % 2 ? -1 : 1) * Math.ceil(k / 2);
    taken.push({ x: at, y: line, width });
    if (Math.abs(line - y - 4) > 8) draw(svg, "line", { x1: x, y1: y, x2: left ? at + width + 2 : at - 2, y2: line - 4, stroke: color, opacity: 0.5 });
    draw(svg, "text", { x: at, y: line, style: `fill:${color};font-size:10px` }, p.name);
  }
}

// The picture of a Z-width map with its axes about it.
function zWidthCard(parent, map) {
  const card = put(parent, "div", { class: "card" });
  const svg = draw(card, "svg", { viewBox: "0 0 300 232", role: "img", "aria-label": "Z-width, " + map.device });
  const box = { left: 40, right: 294, top: 18, bottom: 192 };
  if (map.png) draw(svg, "image", { href: map.png, x: box.left, y: box.top, width: box.right - box.left,
    height: box.bottom - box.top, preserveAspectRatio: "none" });
  const ks = [...new Set(map.cells.map(c => c.stiffness_n_per_m))], bs = [...new Set(map.cells.map(c => c.damping_n_s_per_m))];
  const wide = (box.right - box.left) / ks.length, high = (box.bottom - box.top) / bs.length;
  ks.forEach((k, i) => {
    if (i % (ks.length > 10 ? 4 : 2) === 0) draw(svg, "text", { x: box.left + (i + 0.5) * wide, y: box.bottom + 14, "text-anchor": "middle", class: "soft" }, figure(k / 1000, 2));
  });
  bs.forEach((b, i) => draw(svg, "text", { x: box.left - 5, y: box.bottom - (i + 0.5) * high + 4, "text-anchor": "end", class: "soft" }, figure(b, 2)));
  draw(svg, "text", { x: box.right, y: box.bottom + 32, "text-anchor": "end" }, "stiffness, N/mm");
  draw(svg, "text", { x: 4, y: 12 }, "damping, N s/m");
  put(card, "div", {}, `${map.device}, ${map.delay_ticks} ticks of delay: still up to ${figure(map.stiffest_stable_n_per_m / 1000)} N/mm`);
}

// What a cell of the grid shows: what its scene is about.
function gridFigure(g, c) {
  if (g.id === "A12" && g.scene !== "extremes/plane") return figure(c.free_force_n ?? 0, 2) + " N";
  if (g.id === "A14") return figure(c.closed_form_n ?? 0, 2) + " N";
  if (g.id === "A11") return figure(c.penetration_voxels, 2);
  return figure(c.penetration_voxels, 2) + " / " + figure(c.excess_jump_n, 2);
}
function gridTable(parent, title, rows, text, hint) {
  const details = put(parent, "details");
  put(details, "summary", {}, `${title}: ${rows.length} rows`);
  let made = false; // tens of thousands of cells: made when somebody looks
  const make = () => {
    if (made || !details.open) return;
    made = true;
    const names = Object.keys(rows[0].cells);
    const body = table(details, ["scene", "trajectory", ...names], names.map((_, i) => i + 2));
    let last = "";
    for (const g of rows) {
      const row = put(body, "tr"), scene = g.id + " " + g.scene;
      put(row, "td", { style: "white-space:nowrap" }, scene === last ? "" : scene);
      last = scene;
      put(row, "td", { style: "white-space:nowrap" }, g.trajectory);
      for (const name of names) {
        const c = g.cells[name];
        const cell = put(row, "td", { class: "n" }, c.why === undefined ? text(g, c) : "\u2013");
        cell.title = name + "\n" + (c.why ?? hint(c)) + (c.beyond ? "\nbeyond its bound: " + c.beyond : "");
        if (c.within_bounds !== undefined) cell.className = "n " + (c.within_bounds ? "good" : "bad");
      }
    }
    const why = new Map(); // each reason for an empty cell, and whose cells it empties
    for (const g of rows)
      for (const name of names)
        if (g.cells[name].why !== undefined) {
          const key = g.cells[name].why;
          if (!why.has(key)) why.set(key, { scenes: new Set(), names: new Set() });
          why.get(key).scenes.add(g.id + (g.id === "A12" ? " " + g.scene : ""));
          why.get(key).names.add(name);
        }
    for (const [reason, of] of why)
      put(details, "p", { class: "soft" }, `\u2013 ${reason}: ` +
        (of.names.size === names.length ? "every algorithm" : [...of.names].join(", ")) + " on " +
        (of.scenes.size > 6 ? `${of.scenes.size} kinds of scene` : [...of.scenes].join(", ")));
  };
  details.addEventListener("toggle", make);
  if (location.hash === "#open") { details.open = true; make(); }
}

function touchSection(t) {
  part("Algorithms over all scenes and trajectories", "A printed algorithm keeps the faults of its paper. Penetration is of the proxy under the true surface on A1 to A6, in " +
    "voxels of the coarsest axis; direction is the 99th percentile of the angle to the true force on clean scenes; an excess jump is what a force changes in a tick beyond k |dx|. " +
    "Sampled tools are balls of 1.5 voxels and are held against the closed form of such a ball.");
  let body = table(page, ["algorithm", "", "cells", "outside bounds", "passed through", "penetration", "direction, deg", "jump, N", "jump on edits, N"], [2, 3, 4, 5, 6, 7, 8]);
  for (const a of t.algorithms) {
    const row = put(body, "tr");
    put(row, "td", {}, a.name).title = a.purpose;
    put(row, "td", { class: "soft" }, a.as_printed ? "as printed" : "repaired");
    for (const v of [a.cells, a.outside_bounds, a.pop_throughs, a.penetration_voxels, a.direction_p99_deg, a.excess_jump_n, a.edit_jump_n])
      put(row, "td", { class: "n" }, figure(v));
  }
  part("What the repaired ones are held to", "Beside each figure the cell where it is worst. Directions are the 99th percentile of all ticks together; below it that of the worst cell alone. Red does not hold.");
  put(page, "p", { class: "soft" }, `The ${t.bounds.form} form, trajectories of at most ${t.bounds.most_ticks} ticks; run were ` +
    `${t.bounds.parts.join(", ")} of ${t.bounds.algorithms.join(", ")}.`);
  const held = [...new Set(t.bounds.rows.flatMap(b => Object.keys(b.figures)))];
  body = table(page, ["", "gate", ...held], []);
  for (const b of t.bounds.rows) {
    const row = tableRow(body, [b.asked, figure(b.gate)], []);
    for (const name of held) {
      const c = b.figures[name];
      const cell = put(row, "td", {}, c ? undefined : figure(undefined));
      if (!c) continue; // its part was not run
      put(cell, "div", { class: c.within ? "good" : "bad" }, figure(c.figure));
      if (c.worst_figure !== undefined) put(cell, "div", { class: "soft" }, "worst cell " + figure(c.worst_figure));
      if (c.worst_cell) put(cell, "div", { class: "soft" }, c.worst_cell);
    }
  }
  part("The metrics of the plan", "Of the repaired algorithms, the worst of all their cells. Red does not hold.");
  const who = Object.keys(t.metrics.find(m => m.figures).figures);
  body = table(page, ["", "gate", ...who], who.map((_, i) => i + 2));
  for (const m of t.metrics) {
    const row = tableRow(body, [m.metric, m.gate], []);
    if (m.proved_by) {
      put(row, "td", { colspan: who.length, class: "soft" }, "in tests: " + m.proved_by);
      continue;
    }
    for (const name of who) {
      const c = m.figures[name];
      const cell = put(row, "td", { class: "n" }, figure(c?.figure));
      if (c?.within !== undefined) cell.className = "n " + (c.within ? "good" : "bad");
    }
  }
  part("Speed beside error", "Left is faster, down is more exact; circles are repaired, triangles as printed. Time is the 99th percentile of a tick's processor time; " +
    "errors below 0.001 lie at 0.001. " +
    "Algorithms that know no surface (viscosity, potential, vector) are left out.");
  const cards = put(page, "div", { class: "cards" });
  const pairs = t.times.filter(r => r.samples !== 2000).map(r => [r, t.algorithms.find(a => a.name === r.algorithm)])
    .filter(([, a]) => a && !/viscosity|potential|vector|literal/.test(a.name));
  for (const [key, title] of [["direction_p99_deg", "direction p99, clean, degrees"], ["penetration_voxels", "penetration, A1 - A6, voxels"], ["excess_jump_n", "excess jump, clean, N"]])
    touchPlot(put(cards, "div", { class: "card" }), pairs.map(([r, a]) => ({ name: a.name, printed: a.as_printed, x: r.p99_us, y: Math.max(a[key], 1e-3) })), "us a tick, p99", title);
  part("Our figures beside others'");
  body = table(page, ["", "ours", "papers and programs"], [1]);
  for (const r of t.beside) put(tableRow(body, [r.what], [r.ours]), "td", {}, r.others);
  part("Processor time of a tick, us");
  body = table(page, ["algorithm", "samples", "ticks", "p50", "p99", "p99.9", "max", "over 1 ms"], [1, 2, 3, 4, 5, 6, 7]);
  for (const r of t.times)
    tableRow(body, [r.algorithm], [r.samples, r.ticks, r.p50_us, r.p99_us, r.p999_us, r.max_us, r.misses]);
  part("On one plane", "Energy of a press to 4 mm at 0.2 m/s beyond k v T d; friction of a sliding hand (0.4 is set) and drift of a sticking one; force where T0 is 2 N, as a share of it, and of the spring before it yields; a falcon held 3 mm deep at 1 N/mm.");
  body = table(page, ["algorithm", "energy, mJ", "friction", "drift, um/s", "yields at", "before", "limit cycle, um"], [1, 2, 3, 4, 5, 6]);
  for (const r of t.laws)
    tableRow(body, [r.algorithm], [r.energy_beyond_mj, r.friction_share, r.stick_drift_um_s, r.yield_share, r.below_yield_share, r.limit_cycle_um]);
  part("Z-width", "swept-point against a plane, in a soft hand, at 1 kHz. Green holds still within 50 um; from yellow to red it shakes, by the logarithm of how much.");
  const maps = put(page, "div", { class: "cards" });
  for (const map of t.z_width) zWidthCard(maps, map);
  part("The whole grid", "Deepest penetration in voxels / largest excess jump in N; for A11 the former by the samples' own slope, for A12 the force where nothing is, for A14 the distance to the force's closed form. " +
    "Green is within the bounds, red is not, or was passed through; a dash was not run, and below the table stands why. Pointing at a cell shows the rest, and of a red one which bound it breaks. " +
    "Scenes: A1 planes, A2 balls, A3 cavities, A4 corners, A5 edges, A6 a groove, A7 shells and walls, A8 a Gaussian, A9 curved bodies, A10 noise, " +
    "A11 patients, A12 nothing, no data and odd sizes, A13 edits, A14 force fields. Trajectories: T1 press, T2 sine, T3 crossing, T4 slide, T5 circle, " +
    "T6 hand, T7 walk, T8 fuzz, T9 slide with an encoder's steps, T10 dropouts.");
  for (const stored of [...new Set(t.grid.map(g => g.stored))])
    gridTable(page, stored, t.grid.filter(g => g.stored === stored), gridFigure, c =>
      `${c.ticks} ticks, ${c.contact_ticks} in contact\npassed through ${c.pop_throughs}\ndirection p99 ${figure(c.direction_p99_deg)} deg\nmagnitude p99 ${figure(c.magnitude_p99)}\n` +
      `largest force ${figure(c.largest_force_n)} N\nenergy ${figure(c.energy_mj)} mJ`);
  part("The same with a hand on a simulated device", "Passed through; largest force in N; and, where the trajectory ends in a hold, the limit cycle in um. 500 N/m; the first of each of T1 to T6, on the first storage in the short form.");
  for (const stored of [...new Set(t.closed_loop.map(g => g.stored))])
    gridTable(page, stored, t.closed_loop.filter(g => g.stored === stored),
      (g, c) => `${c.pop_throughs}; ${figure(c.largest_force_n, 2)}` + (c.limit_cycle_um === undefined ? "" : `; ${figure(c.limit_cycle_um, 2)}`),
      c => `not numbers ${c.not_finite}\npenetration ${figure(c.penetration_voxels)}\nwork of the motors ${figure(c.motor_work_mj)} mJ`);
}
