"use strict";
// How often points lie where, as pictures: in the frame, and on a sphere.

const CELL = 8; // pixels of the canvas
const DISC = 28; // cells across a hemisphere

/** Return a canvas of how many points (u, v) lie in each cell: paler for fewer. */
function density(u, v, across, down, columns, rows, variable) {
    const cells = new Float64Array(columns * rows);
    for (let i = 0; i < u.length; i += 1) {
        const column = Math.floor(((u[i] - across[0]) / (across[1] - across[0])) * columns);
        const row = Math.floor(((v[i] - down[0]) / (down[1] - down[0])) * rows);
        if (column >= 0 && column < columns && row >= 0 && row < rows) cells[row * columns + column] += 1;
    }
    const most = Math.max(...cells, 1);
    const canvas = element("canvas", { width: columns * CELL, height: rows * CELL, className: "density" });
    const context = canvas.getContext("2d");
    context.fillStyle = colourNow(variable);
    cells.forEach((count, cell) => {
        const [column, row] = [cell % columns, Math.floor(cell / columns)];
        context.globalAlpha = count ? 0.18 + 0.82 * Math.sqrt(count / most) : 0.04;
        context.fillRect(column * CELL, row * CELL, CELL, CELL);
    });
    return canvas;
}

/** Return the colour that the style sheet's variable is just now, for a canvas. */
function colourNow(variable) {
    const node = element("span");
    node.style.color = `var(${variable})`;
    document.body.append(node);
    const found = getComputedStyle(node).color;
    node.remove();
    return found;
}

/** Return two discs, by Lambert's azimuthal projection, of the directions x, y, z with z > 0 and with z < 0. */
function hemispheres([x, y, z], variable) {
    const discs = [1, -1].map((side) => {
        const [u, v] = [[], []];
        for (let i = 0; i < x.length; i += 1) {
            if (side * z[i] < 0 || Number.isNaN(x[i])) continue;
            const scale = Math.sqrt(1 / (1 + Math.abs(z[i]))); // 1 at the equator
            u.push(x[i] * scale);
            v.push(-side * y[i] * scale); // seen from that side, x to the right
        }
        const canvas = density(u, v, [-1, 1], [-1, 1], DISC, DISC, variable);
        canvas.classList.add("disc");
        canvas.setAttribute("role", "img");
        canvas.setAttribute("aria-label", `Directions of the camera from ${side > 0 ? "+z" : "−z"}`);
        return element(
            "figure",
            {},
            canvas,
            element("figcaption", {}, side > 0 ? "from +z: x right, y up" : "from −z: x right, y down"),
        );
    });
    return element("div", { className: "pair" }, ...discs);
}
