"use strict";
// What is drawn as lines and marks over a picture, as its record has it.

const AXIS_COLOURS = ["#ff4d4d", "#46d160", "#5aa2ff"]; // x, y, z
const EDGES = [
    [0, 1],
    [2, 3],
    [4, 5],
    [6, 7],
    [0, 2],
    [1, 3],
    [4, 6],
    [5, 7],
    [0, 4],
    [1, 5],
    [2, 6],
    [3, 7],
];
const ROOM_PX = 260; // of the screen, that a target with names takes
const STATES = {
    visible: "visible",
    "self-occluded": "hidden by its own body",
    occluded: "hidden by another body",
    outside: "outside the frame",
    behind: "behind the camera",
};

function line([x1, y1], [x2, y2], attributes) {
    return shape("line", { x1, y1, x2, y2, ...attributes });
}

function titled(node, text) {
    node.append(shape("title", {}, text));
    return node;
}

/** Return whether the target is large enough on the screen for names beside its points. */
function roomFor(target, unit) {
    const box = target.box.amodal;
    return box !== null && Math.max(box[2] - box[0], box[3] - box[1]) > ROOM_PX * unit;
}

/** The drawings by their names: each takes a target of the record, the camera, the unit of a screen's pixel, and the
 * target's description. */
const LINES = {
    boxes(target) {
        const found = [];
        for (const [kind, box] of [
            ["amodal", target.box.amodal],
            ["visible", target.box.visible],
        ]) {
            if (!box) continue;
            const [x, y, x1, y1] = box;
            found.push(
                titled(
                    shape("rect", { x, y, width: x1 - x, height: y1 - y, class: `box ${kind}` }),
                    `${target.name}: ${kind} box`,
                ),
            );
        }
        return found;
    },

    cuboid(target) {
        const { corners } = target.box_3d;
        return EDGES.filter(([a, b]) => corners[a] && corners[b]).map(([a, b]) =>
            line(corners[a], corners[b], { class: "cuboid" }),
        );
    },

    keypoints(target, camera, unit, described) {
        return target.keypoints.flatMap(([u, v, state], place) => {
            if (u === null || v === null) return [];
            const name = described?.keypoints[place] ?? String(place + 1);
            const mark = shape("circle", {
                cx: u,
                cy: v,
                r: 4.5 * unit,
                class: `keypoint ${state in STATES ? state : ""}`,
            });
            const label = shape(
                "text",
                { x: u + 7 * unit, y: v - 5 * unit, "font-size": 11 * unit, class: "name" },
                name,
            );
            return [titled(mark, `${name}: ${STATES[state] ?? state}`), ...(roomFor(target, unit) ? [label] : [])];
        });
    },

    axes(target, camera, unit, described) {
        const origin = camera.project(toCamera(target.pose, [0, 0, 0]));
        const length = 0.6 * Math.max(...(described?.size ?? [1]));
        return AXIS_COLOURS.flatMap((colour, axis) => {
            const tip = [0, 0, 0];
            tip[axis] = length;
            const end = camera.project(toCamera(target.pose, tip));
            if (!origin || !end) return [];
            const label = shape(
                "text",
                { x: end[0] + 4 * unit, y: end[1], "font-size": 13 * unit, fill: colour, class: "name" },
                "xyz"[axis],
            );
            return [line(origin, end, { class: "axis", stroke: colour }), label];
        });
    },
};
