"use strict";
// Elements, made without any HTML text: whatever a dataset holds is shown as text, and never read as a page.

const SVG = "http://www.w3.org/2000/svg";

function byId(id) {
    return document.getElementById(id);
}

/** Return an element with these properties, attributes (names with "-", role) and children. */
function element(name, properties = {}, ...children) {
    return filled(document.createElement(name), properties, children);
}

/** Return an element of SVG with these attributes and children. */
function shape(name, attributes = {}, ...children) {
    const made = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    made.append(...children);
    return made;
}

function filled(made, properties, children) {
    for (const [key, value] of Object.entries(properties)) {
        if (key.includes("-") || key === "role" || key === "list") made.setAttribute(key, value);
        else made[key] = value;
    }
    made.append(...children);
    return made;
}

/** Return the number for people: as many digits as tell it from its neighbours, six at most. */
function shown(value, digits = 6) {
    if (typeof value !== "number" || Number.isNaN(value)) return "–";
    if (Number.isInteger(value)) return String(value);
    return String(Number(value.toPrecision(digits)));
}

/** Return the shortest text that is this float32 and no other. */
function exactly(value) {
    for (let digits = 6; digits < 9; digits += 1) {
        const text = Number(value.toPrecision(digits));
        if (Math.fround(text) === value) return String(text);
    }
    return String(Number(value.toPrecision(9)));
}
