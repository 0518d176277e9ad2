"use strict";
// Labels in colours, as spin_usd.labels.preview has them. Each function takes planes of numbers and how many pixels
// there are, and returns a function that gives a pixel's red, green and blue, or null where the label has nothing.

const VIRIDIS = [
    [68, 1, 84],
    [72, 40, 120],
    [62, 73, 137],
    [49, 104, 142],
    [38, 130, 142],
    [31, 158, 137],
    [53, 183, 121],
    [110, 206, 88],
    [181, 222, 43],
    [253, 231, 37],
];
const GOLDEN = (Math.sqrt(5) - 1) / 2;

/** Return the colour at a share from 0, dark blue, to 1, yellow. */
function viridis(share) {
    const at = Math.min(Math.max(share, 0), 1) * (VIRIDIS.length - 1);
    const low = Math.min(Math.floor(at), VIRIDIS.length - 2);
    return VIRIDIS[low].map((each, channel) => Math.round(each + (at - low) * (VIRIDIS[low + 1][channel] - each)));
}

/** Return the colour of an id: neighbours differ in hue, saturation and brightness. */
function idColour(id) {
    return hsv((id * GOLDEN) % 1, [0.45, 0.85, 0.65][id % 3], [1, 0.75][id % 2]);
}

function hsv(hue, saturation, value) {
    return [5, 3, 1].map((n) => {
        const k = (n + hue * 6) % 6;
        return Math.round(255 * value * (1 - saturation * Math.max(0, Math.min(k, 4 - k, 1))));
    });
}

/** Return the colour at a share of the distances seen, from 0, the nearest. */
function distanceColour(share) {
    return viridis(0.95 - 0.8 * share);
}

function seenExtent(plane, seen) {
    let low = Infinity,
        high = -Infinity;
    for (let i = 0; i < plane.length; i += 1) {
        if (!seen(i)) continue;
        if (plane[i] < low) low = plane[i];
        if (plane[i] > high) high = plane[i];
    }
    return [low, high];
}

const COLOURS = {
    by_sign([more]) {
        return (i) => (more[i] === 128 ? null : more[i] > 128 ? [255, 40, 40] : [40, 90, 255]);
    },
    by_distance([metres]) {
        const seen = (i) => metres[i] > 0;
        const [low, high] = seenExtent(metres, seen);
        const table = Array.from({ length: 256 }, (_, level) => distanceColour(level / 255));
        return (i) => (seen(i) ? table[Math.round((255 * (metres[i] - low)) / (high - low || 1))] : null);
    },
    by_id([ids]) {
        const table = new Map();
        return (i) => {
            if (!ids[i]) return null;
            if (!table.has(ids[i])) table.set(ids[i], idColour(ids[i]));
            return table.get(ids[i]);
        };
    },
    by_bit([bits]) {
        return (i) => (bits[i] ? idColour(Math.log2(bits[i] & -bits[i]) + 1) : null);
    },
    by_position(planes) {
        const seen = (i) => planes.some((plane) => plane[i] !== 0);
        const spans = planes.map((plane) => seenExtent(plane, seen));
        return (i) =>
            seen(i)
                ? planes.map(
                      (plane, axis) =>
                          30 + (225 * (plane[i] - spans[axis][0])) / (spans[axis][1] - spans[axis][0] || 1),
                  )
                : null;
    },
    by_direction(planes) {
        return (i) => (planes.some((plane) => plane[i] !== 0) ? planes.map((plane) => 127.5 + 127.5 * plane[i]) : null);
    },
    by_motion([right, down, fate]) {
        let longest = 1e-30;
        for (let i = 0; i < right.length; i += 1)
            if (fate[i] > 0) longest = Math.max(longest, Math.hypot(right[i], down[i]));
        return (i) => {
            if (!(fate[i] > 0)) return null;
            const turn = Math.atan2(down[i], right[i]) / (2 * Math.PI);
            return hsv((turn + 1) % 1, Math.hypot(right[i], down[i]) / longest, 1);
        };
    },
};

/** Return the scale of a label of distances: its colours, from the nearest at the top to the farthest. */
function scaleOf(title, [metres]) {
    const [low, high] = seenExtent(metres, (i) => metres[i] > 0);
    const bar = element("canvas", { width: 1, height: 256 });
    const context = bar.getContext("2d");
    for (let level = 0; level < 256; level += 1) {
        context.fillStyle = `rgb(${distanceColour(level / 255).join(" ")})`;
        context.fillRect(0, level, 1, 1);
    }
    const ends = [low, (low + high) / 2, high].map((end) => element("span", {}, `${end.toPrecision(4)} m`));
    return element(
        "figure",
        { className: "scale", "aria-label": `Scale of ${title}` },
        element("figcaption", {}, title),
        bar,
        element("div", {}, ...(Number.isFinite(low) ? ends : [])),
    );
}

/** Return the label in its colours as a canvas of that size. */
function painted(planes, style, width, height) {
    const colourOf = (COLOURS[style] ?? COLOURS.by_position)(planes);
    const canvas = element("canvas", { width, height });
    const context = canvas.getContext("2d");
    const image = context.createImageData(width, height);
    for (let i = 0; i < width * height; i += 1) {
        const colour = colourOf(i);
        if (colour) {
            image.data[4 * i] = colour[0];
            image.data[4 * i + 1] = colour[1] ?? colour[0];
            image.data[4 * i + 2] = colour[2] ?? colour[0];
            image.data[4 * i + 3] = 255;
        }
    }
    context.putImageData(image, 0, 0);
    return canvas;
}
