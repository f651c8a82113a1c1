// The page of `palpate bench`: a section for each suite. put, draw, table, plotAxes, mark and figure are the
// page's own (page_template.html).

const kinds = {
  "fast": ["circle", "var(--c0)"], "preintegrated": ["square", "var(--c3)"], "exact": ["diamond", "var(--c2)"],
  "VTK GPU mapper": ["triangle", "var(--c1)"], "VTK fixed-point mapper": ["triangle", "var(--c4)"],
};
const kindOf = p => p.renderer === "palpate" ? p.integrator : p.renderer;
const unitText = { colour: "RMSE, colour 0 to 1", HU: "RMSE, HU", samples: "surface error, RMS, voxels" };

function frontPlot(parent, panel) {
  const points = panel.points.filter(p => p.time && p.error);
  const svg = draw(parent, "svg", { viewBox: "0 0 400 312", role: "img", "aria-label": panel.title });
  const box = { left: 52, right: 392, top: 20, bottom: 255 };
  const ms = p => p.time.wall_ms.median;
  const axes = plotAxes(svg, box, points.flatMap(p => [p.time.wall_ms.low, p.time.wall_ms.high]),
    points.map(p => p.error.rmse), "ms a frame", unitText[panel.unit] ?? panel.unit);
  const front = points.filter(p => p.on_front).sort((a, b) => ms(a) - ms(b));
  // What the front dominates lies above and to the right of these steps.
  let path = "";
  front.forEach((p, i) => {
    const x = axes.x(ms(p)), y = axes.y(p.error.rmse);
    path += i === 0 ? `M${x} ${box.top}V${y}` : `H${x}V${y}`;
  });
  if (front.length) draw(svg, "path", { d: path + `H${box.right}`, fill: "none", stroke: "var(--c0)",
    "stroke-width": 1.2, "stroke-dasharray": "4 3", opacity: 0.75 });
  for (const p of points) {
    const [shape, color] = kinds[kindOf(p)] ?? ["circle", "var(--ink)"];
    const x = axes.x(ms(p)), y = axes.y(p.error.rmse);
    draw(svg, "line", { x1: axes.x(p.time.wall_ms.low), x2: axes.x(p.time.wall_ms.high), y1: y, y2: y, stroke: color, opacity: 0.6 });
    if (p.default) draw(svg, "circle", { cx: x, cy: y, r: 8, fill: "none", stroke: color });
    mark(svg, shape, x, y, color, p.renderer === "palpate" && !p.on_front,
      `${p.renderer === "palpate" ? "palpate, " : ""}${p.name}\n${figure(ms(p))} ms (p95 ${figure(p.time.wall_ms.p95)}), RMSE ${figure(p.error.rmse)}`);
  }
  let at = box.left;
  for (const kind of Object.keys(kinds)) {
    if (!points.some(p => kindOf(p) === kind)) continue;
    const [shape, color] = kinds[kind];
    mark(svg, shape, at + 5, 301, color, false, kind);
    const label = kind.replace(" mapper", "").replace("fixed-point", "fixed");
    draw(svg, "text", { x: at + 14, y: 305 }, label);
    at += 24 + 6.2 * label.length;
  }
}
function panelCard(parent, panel, suite) {
  const card = put(parent, "div", { class: "card" });
  put(card, "h3", {}, panel.title);
  frontPlot(card, panel);
  const line = put(card, "p", { style: "margin:6px 0 0" });
  if (panel.default_on_front !== undefined) {
    verdict(line, "span", panel.default_on_front || panel.default_is_judged === false, panel.default_on_front
      ? "default on its front" : panel.default_is_judged === false ? "default off its front (a scene made to defeat it)" : "default off its front");
    line.append(" \u00b7 ");
  }
  if (panel.below_all_peers !== undefined)
    verdict(line, "span", panel.below_all_peers, panel.below_all_peers
      ? "strictly below every VTK point" : "not below every VTK point");
  else put(line, "span", { class: "soft" }, suite.peers?.absent_because || "no VTK point to compare with");
  const details = put(card, "details");
  put(details, "summary", {}, "figures");
  const body = table(details, ["", "ms", "p95", "GPU ms", "CPU ms", "RMSE", "max", "99.9 %", "FLIP", "ours below"], [1, 2, 3, 4, 5, 6, 7, 8]);
  for (const p of panel.points) {
    const row = tableRow(body, [p.name + (p.default ? " (default)" : "")],
      [p.time?.wall_ms.median, p.time?.wall_ms.p95, p.time?.gpu_ms?.median, p.time?.cpu_ms?.median,
        p.error?.rmse, p.error?.max, p.error?.p999, p.error?.flip_mean]);
    const below = put(row, "td");
    if (p.we_are_below !== undefined)
      verdict(below, "span", p.we_are_below, p.we_are_below
        ? `${p.our_point}: ${figure(p.times_faster, 2)}x faster` + (p.times_less_error ? `, ${figure(p.times_less_error, 2)}x less error` : ", no error") : "no");
  }
}

function convergenceSection(parent, list) {
  const cards = put(parent, "div", { class: "cards" });
  for (const title of [...new Set(list.map(c => c.title))]) {
    const curves = list.filter(c => c.title === title);
    const card = put(cards, "div", { class: "card" });
    put(card, "h3", {}, title);
    const svg = draw(card, "svg", { viewBox: "0 0 400 304", role: "img", "aria-label": title });
    const box = { left: 52, right: 392, top: 20, bottom: 245 };
    const axes = plotAxes(svg, box, curves.flatMap(c => c.steps), curves.flatMap(c => c.rmse), "step or sub-step, samples", "RMSE, colour 0 to 1");
    let at = box.left;
    for (const c of curves) {
      const [shape, color] = kinds[c.integrator];
      if (c.order !== undefined)
        draw(svg, "line", { x1: axes.x(c.fitted_from), y1: axes.y(c.factor * Math.pow(c.fitted_from, c.order)),
          x2: axes.x(c.fitted_to), y2: axes.y(c.factor * Math.pow(c.fitted_to, c.order)), stroke: color, opacity: 0.6 });
      c.steps.forEach((step, i) => mark(svg, shape, axes.x(step), axes.y(c.rmse[i]), color,
        c.order === undefined || step < c.fitted_from || step > c.fitted_to, `${c.integrator}, ${figure(step)}: ${figure(c.rmse[i])}`));
      mark(svg, shape, at + 5, 293, color, false, c.integrator);
      draw(svg, "text", { x: at + 14, y: 297 }, c.integrator);
      at += 30 + 6.2 * c.integrator.length;
    }
    const body = table(card, ["integrator", "order", "95 % band", "points"], [1, 2, 3]);
    for (const c of curves)
      tableRow(body, [c.integrator], [c.order, c.band_95 === undefined ? undefined : "\u00b1 " + figure(c.band_95, 2), c.fitted_points ?? 0]);
  }
}

function ratioBar(cell, ratio, color) {
  cell.style.whiteSpace = "nowrap";
  const width = Math.min(64, 16 * Math.abs(Math.log2(Math.max(ratio, 1e-6))));
  put(cell, "span", { class: "bar", style: `width:${Math.max(1, width)}px;background:${color};opacity:${ratio > 1 ? 1 : 0.45}` });
  cell.append(" " + (ratio >= 1 ? "x " : "\u00f7 ") + figure(ratio >= 1 ? ratio : 1 / ratio, 2));
}
function factorTable(parent, rows, heads) {
  const body = table(parent, heads);
  let last = "";
  for (const r of rows) {
    const row = tableRow(body, [r.factor === last ? "" : r.factor, r.level], []);
    last = r.factor;
    ratioBar(put(row, "td"), r.time_ratio, "var(--c0)");
    ratioBar(put(row, "td"), r.error_ratio, "var(--c1)");
  }
}

function heading(suite) {
  const titles = { quality: "Error against time", render: "Modes, integrators, sizes", stability: "Hard cases", upload: "Uploads", touch: "Touch", surface: "Surfaces", edit: "From the hand to pixels", frame: "What a frame costs the recording thread", segment: "Filters and segmentation" };
  put(page, "h2", { id: suite.suite }, titles[suite.suite] ?? suite.suite);
  const line = put(page, "p", { class: "soft" },
    `${suite.form} form, ${suite.started_utc} UTC, ${figure(suite.duration_s)} s; other programs kept ${figure(suite.busy_neighbours, 2)} cores busy meanwhile. `);
  verdict(line, "span", suite.pass, suite.pass ? "passed" : "failed");
  for (const [list, style] of [[suite.failures, "bad"], [suite.notes, "soft"]])
    if (list?.length) {
      const items = put(page, "ul");
      for (const sentence of list) put(items, "li", { class: style }, sentence);
    }
  if (suite.peers?.absent_because) put(page, "p", { class: "bad" }, suite.peers.absent_because);
}

put(page, "h1", {}, "Palpate: speed beside error");
if (!results.length) put(page, "p", {}, "No results yet.");
else {
  const e = results[0].environment;
  put(page, "p", { class: "soft" }, `${e.device}, ${e.driver}; ${e.cpu}, ${e.cores} cores, ${figure(e.memory_bytes / 2 ** 30)} GiB; ` +
    `commit ${e.commit}, ${e.compiler}, ${e.build_type}; ${e.system}`);
  const nav = put(page, "nav");
  for (const suite of results) put(nav, "a", { href: "#" + suite.suite }, suite.suite);
}
for (const suite of results) {
  heading(suite);
  if (suite.panels?.length) {
    put(page, "p", {}, "Both axes are logarithmic: left is faster, down is more exact. Time is the median of the frames by fenced wall clock, with " +
      "the interval that holds it; the error is the RMSE against grid truth, the exact picture of the trilinear field. The dashed line is our front, " +
      "hollow marks lie behind it, the ring is the default. VTK" + (suite.peers?.vtk ? " " + suite.peers.vtk : "") +
      " draws the same scene in the same run; its pictures have 8 bits, which adds about 0.001 to colours, and its fixed-point mapper gives no depth, so its surfaces count as right where they are seen at all.");
    const cards = put(page, "div", { class: "cards" });
    for (const panel of suite.panels) panelCard(cards, panel, suite);
  }
  if (suite.aims?.length) {
    part("Aims");
    const body = table(page, ["", "aim", "figure", ""], [2]);
    for (const aim of suite.aims)
      verdict(tableRow(body, [aim.what, aim.aim], [aim.figure]), "td", aim.reached, aim.reached ? "reached" : "not reached");
  }
  if (suite.first_frames?.length) {
    part("First frame, in ms: upload, shaders compiled, one frame");
    const who = [...new Set(suite.first_frames.map(f => f.renderer))];
    const body = table(page, ["", ...who], who.map((_, i) => i + 1));
    for (const subject of [...new Set(suite.first_frames.map(f => f.subject))])
      tableRow(body, [subject], who.map(w => suite.first_frames.find(f => f.subject === subject && f.renderer === w)?.ms));
  }
  if (suite.convergence?.length) {
    part("Orders of convergence", "Fitted to the points that stand four times above the smallest error (filled marks). The exact integrator has no step: for it the axis is the part of a cell that a sub-step takes.");
    convergenceSection(page, suite.convergence);
  }
  if (suite.maps?.length) {
    part("Error maps", "Difference from grid truth at each scored pixel, as its square root; one scale for each scene, brightest where 0.1 % of our default's pixels err more.");
    const cards = put(page, "div", { class: "cards maps" });
    for (const map of suite.maps) {
      const card = put(cards, "div", { class: "card" });
      if (map.png) put(card, "img", { src: map.png, alt: map.title });
      put(card, "div", {}, map.title);
      put(card, "div", { class: "soft" }, "brightest: " + figure(map.brightest));
    }
  }
  if (suite.factors) {
    part("What each choice does", `On the phantom, RMSE of colours. The default takes ${figure(suite.factors.default.ms)} ms and errs by ${figure(suite.factors.default.rmse)}. ` +
      `Left: one choice moved away from it. Right: all moved at once in ${suite.factors.hypercube.length} settings; geometric mean of a level beside that of all.`);
    const cards = put(page, "div", { class: "cards" });
    factorTable(put(cards, "div", { class: "card" }), suite.factors.one_at_a_time, ["choice", "instead", "time", "error"]);
    factorTable(put(cards, "div", { class: "card" }), suite.factors.main_effects, ["factor", "level", "time", "error"]);
  }
  if (suite.cases?.length) {
    const body = table(page, ["case", "what is hard", "measured", "figure", "bound", ""], [3, 4]);
    for (const one of suite.cases) {
      const lines = one.lines?.length ? one.lines : [one];
      lines.forEach((line, i) => {
        const row = tableRow(body, [i === 0 ? one.name : "", i === 0 ? one.title : "", line.part ?? ""], [line.figure, line.bound]);
        if (i === 0 && one.why) row.firstChild.title = one.why;
        const cell = verdict(row, "td", line.pass);
        if (line.sentence) cell.title = line.sentence;
      });
    }
  }
  if (suite.touch) touchSection(suite.touch);
  if (suite.surfaces?.length) {
    const body = table(page, ["volume", "by", "ms", "p95", "triangles", "Mtri/s", "vertices off, mm", "surface off, RMS mm", "normals off, RMS deg"], [2, 3, 4, 5, 6, 7, 8]);
    for (const r of suite.surfaces)
      tableRow(body, [r.case, r.who],
        [r.ms.median, r.ms.p95, r.triangles, r.mtri_per_s, r.vertex_largest_mm ?? "", r.rms_mm ?? "", r.normal_rms_deg ?? ""]);
  }
  if (suite.suite === "surface" && suite.edits?.length) {
    part("A dab: erosion of a Gaussian of 128 x 128 x 128", "Table 1 of Vidholm and Agmund (2004): what brings the surface up to date after the edit, ms and edits a second. The tracker is the paper's own extractor, " +
      "which makes all triangles again; blocks makes those again that read a changed sample, on the processor and on the device (gpu); flying edges extract everything again.");
    const who = [...new Set(suite.edits.map(r => r.who))];
    const body = table(page, ["triangles", "radius, samples", "printed in 2004, edits/s", ...who.flatMap(w => [w + ", ms", "edits/s"])], [...Array(3 + 2 * who.length).keys()]);
    for (const first of suite.edits.filter(r => r.who === who[0])) {
      const figures = [first.triangles, first.radius_samples, first.printed_edits_per_s ?? ""].map(String);
      for (const w of who) {
        const r = suite.edits.find(r => r.who === w && r.triangles === first.triangles && r.radius_samples === first.radius_samples);
        figures.push(r?.ms.median ?? "", r?.edits_per_s ?? "");
      }
      tableRow(body, [], figures);
    }
  }
  if (suite.suite === "surface" && suite.live?.length) {
    part(`A dab of radius 5 mm in a surface in the picture: ${suite.live[0].volume}, ${suite.live[0].triangles} triangles`,
      "Medians of a dab, beside the first frame. device and cpu: a live surface and who makes its blocks; mesh: all blocks joined, and of the mesh the pieces uploaded that differ.");
    const body = table(page, ["by", "blocks", "of", "bytes", "of", "ms to record", "ms a frame", "same picture"], [1, 2, 3, 4, 5, 6]);
    for (const r of suite.live)
      put(tableRow(body, [r.who], [r.blocks.median, r.first_blocks, r.bytes.median, r.first_bytes, r.record_ms.median, r.frame_ms.median]),
        "td", {}, r.same_picture ? "yes" : "no");
  }
  if (suite.suite === "surface" && suite.window)
    put(page, "p", {}, `A window of ${suite.window.samples} x ${suite.window.samples} x ${suite.window.samples} samples for the hand: ${figure(suite.window.p50_us)} us, 99th percentile ${figure(suite.window.p99_us)}, worst ${figure(suite.window.worst_us)} of ${suite.window.count}.`);
  if (suite.orders?.length) {
    put(page, "h3", {}, "Order of convergence on the sphere");
    const body = table(page, ["by", "distance", "area", "volume"], [1, 2, 3]);
    for (const r of suite.orders) tableRow(body, [r.who], [r.rms, r.area, r.volume]);
  }
  if (suite.filters?.length) {
    put(page, "p", {}, `${suite.filter_title}. Ours and ITK's filter run in turn on the same samples; medians. The error is against an exact reference in double at 512 samples spread over the volume, in units of the result.`);
    const body = table(page, ["filter", "setting", "ms", "error, RMS", "largest", "ITK, ms", "error, RMS", "largest", "times faster"], [2, 3, 4, 5, 6, 7, 8]);
    for (const r of suite.filters)
      tableRow(body, [r.name, r.setting], [r.ours_ms.median, r.ours_error?.rms ?? r.ours_error?.residual ?? "", r.ours_error?.max ?? "", r.itk_ms?.median ?? "", r.itk_error?.rms ?? r.itk_error?.residual ?? "", r.itk_error?.max ?? "", r.ratio ?? ""]);
  }
  if (suite.study) studySection(suite.study);
  if (suite.frames?.length) {
    put(page, "p", {}, suite.frame_title);
    const body = table(page, ["view", "volume", "lies as", "frames", "median, ms", "p95", "worst", "bytes uploaded"], [4, 5, 6, 7]);
    for (const r of suite.frames)
      tableRow(body, [r.view, r.volume, r.residency, r.frames],
        [r.cpu_ms.median, r.cpu_ms.p95, r.cpu_ms.worst, r.uploaded_bytes_median]);
  }
  if (suite.suite === "edit") editSection(suite);
  else if (suite.rows?.length) {
    put(page, "p", {}, suite.title ?? "");
    const body = table(page, ["", "MB", "ms", "p95", "GB/s", "memcpy, ms", "share of memcpy"], [1, 2, 3, 4, 5, 6]);
    for (const r of suite.rows)
      tableRow(body, [r.what], [r.bytes / 1e6, r.ms.median, r.ms.p95, r.gb_per_s, r.memcpy_ms, r.share_of_memcpy]);
  }
}
put(page, "h2", {}, "How to read and repeat this");
put(page, "p", {}, "palpate bench quality --short (or --full), render, stability, surface, touch, edit, frame, segment and upload write their results as JSON beside this page; scripts/bench-compare holds two of them against each other. Ratios hold within one run on one machine; absolute times move by tens of per cent between machines.");
