// The page of `palpate touch --page`: one run of the servo over time. put, draw and plotAxes are the
// page's own (page_template.html).

function timePlot(parent, panel, run) {
  put(parent, "h3", { style: "margin-top:20px" }, panel.title);
  const svg = draw(parent, "svg", { viewBox: "0 0 960 244", role: "img", "aria-label": panel.title });
  const box = { left: 62, right: 950, top: 26, bottom: 210 };
  const values = panel.curves.flatMap(c => [...c.low, ...c.high]);
  const at = plotAxes(svg, box, [run.from_s, run.to_s], values, "time, s", "", { log: false, pad: 0 }, { log: false });
  let legend = box.left;
  for (const curve of panel.curves) {
    const style = { fill: "none", "stroke-width": 1.4, "stroke-linejoin": "round" };
    style.stroke = `var(--c${curve.color})`;
    if (curve.dashed) style["stroke-dasharray"] = "4 3";
    let path = ""; // in each column from its largest value to its least
    curve.low.forEach((low, i) => {
      if (low === null) return;
      const x = box.left + (i + 0.5) / curve.low.length * (box.right - box.left);
      path += `${path ? "L" : "M"}${x.toFixed(1)} ${at.y(curve.high[i]).toFixed(2)}V${at.y(low).toFixed(2)}`;
    });
    draw(svg, "path", { d: path, ...style });
    draw(svg, "path", { d: `M${legend} 12h18`, ...style });
    draw(svg, "text", { x: legend + 24, y: 16 }, curve.name);
    legend += 40 + 7 * curve.name.length;
  }
}

const run = results[0];
document.title = run.title;
put(page, "h1", {}, run.title);
put(page, "p", { class: "soft" }, run.summary);
for (const panel of run.panels) timePlot(page, panel, run);
