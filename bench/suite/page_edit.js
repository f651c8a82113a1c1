// The edit section of the page: how long a dab takes on its way from the hand to pixels.

function latencyTable(rows) {
  const body = table(page, ["", "median, ms", "p99", "95 % interval of the median", "wanted", ""], [1, 2, 4]);
  for (const r of rows) {
    const row = tableRow(body, [r.what], [r.ms.median, r.ms.p99]);
    put(row, "td", { class: "soft" }, r.ms.low === undefined ? "" : `${figure(r.ms.low)} to ${figure(r.ms.high)}`);
    put(row, "td", { class: "n" }, r.target_ms === undefined ? "" : figure(r.target_ms));
    if (r.met === undefined) put(row, "td");
    else verdict(row, "td", r.met, r.met ? "reached" : "not reached");
  }
}

function editSection(e) {
  put(page, "p", {}, e.title + `: ${figure(e.bricks_changed_median)} bricks changed and ${figure(e.blocks_meshed_median)} blocks of 8 x 8 x 8 were meshed again, in the middle of all dabs.`);
  latencyTable(e.rows);
  const median = start => e.rows.find(r => r.what.startsWith(start))?.ms.median;
  part("Beside others", "VTK makes the whole surface and uploads the whole texture again; paper 3 is the drilling of UEA, paper 5 the milling of Eriksson et al. Medians, ms.");
  const body = table(page, ["", "ours", "VTK" + (e.vtk?.vtk ? " " + e.vtk.vtk : ""), "papers"], [1, 2, 3]);
  const beside = (what, ...figures) => tableRow(body, [what], figures);
  beside("surface after the dab", median("surface of changed blocks"), e.vtk?.whole_surface_ms, "0.4 (paper 3)");
  beside("upload after the dab", (median("staging") ?? NaN) + (median("copy command") ?? NaN), e.vtk?.whole_texture_ms, "\u2013");
  beside("snapshot to uploaded and re-meshed", median("snapshot to uploaded"), e.vtk?.sum_ms, "\u2013");
  beside("hand to new pixels, iso", median("hand to new pixels, iso"), undefined, "300 (paper 5)");
  beside("hand to new pixels, interactive", median("hand to new pixels, interactive"), undefined, "300 (paper 5)");
  if (e.vtk?.absent_because || !e.vtk) put(page, "p", { class: "soft" }, e.vtk?.absent_because ?? "VTK was not asked.");
  if (e.live) {
    part("A stroke, live", `${figure(e.live.seconds)} s of 1000 poses a second: hand, editor, mesher and frames on threads of their own; ${e.live.frames} frames of ${e.live.snapshots} snapshots. What is behind what:`);
    const rows = table(page, ["", "median", "p99"], [1, 2]);
    for (const [key, value] of Object.entries(e.live))
      if (value && typeof value === "object")
        tableRow(rows, [key.replaceAll("_", " ")], [value.median ?? value.p50, value.p99]);
  }
  if (e.batches?.length) {
    part("Bricks to the device in batches", "Converting them into the staging ring, the copy command, and a plain copy of the same rows by one thread; ms.");
    const rows = table(page, ["bricks", "MB", "staging", "copy command", "memcpy of the rows", "share of memcpy"], [0, 1, 2, 3, 4, 5]);
    for (const b of e.batches)
      tableRow(rows, [], [b.bricks, b.bytes / 1e6, b.staging_ms, b.copy_command_ms, b.memcpy_of_rows_ms, b.copy_share_of_memcpy]);
  }
}
