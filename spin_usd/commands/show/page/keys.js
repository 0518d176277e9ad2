"use strict";
// The keyboard.

const KEYS = [
    [
        "Grid",
        [
            ["← → ↑ ↓", "choose a picture"],
            ["Enter", "show it large"],
            ["Page Up, Page Down, Home, End", "go further"],
            ["t", "crop to the target, or whole frames"],
            ["/", "find a frame by its name"],
        ],
    ],
    [
        "Picture",
        [
            ["← →", "previous, next picture"],
            ["↑ ↓", "previous, next variant of the frame"],
            ["+ −", "zoom; the wheel too"],
            ["z", "zoom to the target"],
            ["f", "show all of the picture"],
            ["i", "hide the image under the overlays"],
            ["0", "no overlays"],
            ["Esc", "back to the grid"],
        ],
    ],
    [
        "Everywhere",
        [
            ["1 to 9", "give the picture a tag, or take it away"],
            ["g", "pictures"],
            ["s", "distributions"],
            ["x", "dark or light"],
            ["?", "these keys"],
        ],
    ],
];

/** Fill the dialog with all keys, those of the overlays too. */
function fillKeys(dialog, overlays, beside) {
    const letters = overlays.all.filter(({ key }) => key).map(({ key, title }) => [key, title]);
    const others = [
        ["w", "both datasets side by side"],
        ["e", "the other dataset's picture"],
        ["r", "both by turns"],
    ];
    const close = element("button", { type: "button" }, "Close");
    close.addEventListener("click", () => dialog.close());
    const parts = [...KEYS, ...(beside ? [["Beside", others]] : []), ["Overlays", letters]].map(([title, keys]) =>
        element("section", {}, element("h3", {}, title), table(keys, "facts keys")),
    );
    dialog.append(element("div", { className: "columns" }, ...parts), close);
}

/** Return whether the event goes to something that is typed into, or that takes arrows itself. */
function isTyping(event) {
    const { tagName, type } = event.target;
    if (tagName === "SELECT" || tagName === "TEXTAREA") return true;
    if (tagName !== "INPUT" || type === "checkbox") return false;
    return type !== "range" || event.key.startsWith("Arrow");
}
