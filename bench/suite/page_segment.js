// The section of segmentation: the liver study, its curves, and real organs.

const studyColors = ["var(--c0)", "var(--c1)", "var(--c2)", "var(--c3)"];

const percent = v => v === undefined || v === null ? "" : 100 * v;

function studyTable(parent, rows, hint) {
  if (hint) put(parent, "p", {}, hint);
  const body = table(parent, ["", "results", "precision, %", "CV, %", "least, %", "sensitivity, %", "worst", "specificity, %", "in the box", "Dice", "worst", "surface, mm", "worst", "below the best threshold", "worst", "clicks", "seconds"], [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16]);
  for (const r of rows) {
    tableRow(body, [r.held_out ? r.name + " (held out)" : r.name], [r.results, percent(r.precision?.mean), percent(r.precision?.cv), percent(r.precision?.least), percent(r.sensitivity.median), percent(r.sensitivity.worst), percent(r.specificity.median), percent(r.box_specificity.median), r.dice.median, r.dice.worst, r.surface_mean_mm?.median ?? "", r.surface_mean_mm?.worst ?? "", r.gap?.median ?? "", r.gap?.worst ?? "", r.clicks ?? "", r.seconds ?? ""]);
    const p = r.print;
    if (p) tableRow(body, ["in print"], ["", percent(p.precision), percent(p.cv), "", percent(p.sensitivity), "", p.specificity ?? "", "", "", "", "", "", "", "", "", p.seconds]);
  }
}

function studyCurves(parent, curves) {
  const svg = draw(parent, "svg", { viewBox: "0 0 400 300", role: "img", "aria-label": "Dice after clicks", style: "display:block;max-width:560px" });
  const box = { left: 52, right: 392, top: 20, bottom: 262 };
  const xs = curves.flatMap(c => c.dice.map((_, i) => i + 1)), ys = curves.flatMap(c => c.dice);
  const axes = plotAxes(svg, box, xs, ys, "clicks", "Dice, mean", { log: false }, { log: false });
  curves.forEach((c, i) => {
    const color = studyColors[i % studyColors.length];
    draw(svg, "path", { d: c.dice.map((d, k) => `${k ? "L" : "M"}${axes.x(k + 1)} ${axes.y(d)}`).join(""), fill: "none", stroke: color, "stroke-width": 1.6 });
    c.dice.forEach((d, k) => mark(svg, "circle", axes.x(k + 1), axes.y(d), color, false, `${c.method}, ${k + 1} clicks\n${figure(d)}`));
    draw(svg, "text", { x: box.right - 6, y: box.bottom - 10 - 13 * i, "text-anchor": "end", style: `fill:${color};font-size:11px` }, c.method);
  });
}

function studySection(study) {
  part("Liver study", "Nystroem et al. 2008, section 6, with simulated users: abdomens drawn by a generator, whose liver is known. Precision is the mean Jaccard index of two users' results of one volume, as the paper has it; a repeated leak is precise, too, so sensitivity and specificity stand beside it, the latter also in the liver's box and 20 mm about it. Clicks and path are counted; seconds are derived (1.5 s a click, 50 mm/s). What needs people is not reproduced: their time, their outlines (off by an assumed 2 mm here) and their patients.");
  studyTable(page, study.rows);
  if (study.curves?.length) {
    put(page, "p", {}, "One seed, then a correction a click: inside where the liver is missed, outside where the result goes beyond it.");
    studyCurves(page, study.curves);
  }
  if (study.organs?.length)
    studyTable(page, study.organs, "Organs of a real CT, by fast marching from as many seeds; the truth is a label map. Parameters were chosen on phantoms and on those that are not held out.");
}
