// The page of `spin-usd watch`: it shows the state that the server sends, and sends back what is to be shown.

const LIGHTS = { raycast: "preview (raycast)", blender: "Blender" };
const element = (id) => document.getElementById(id);
let state = null;

const stream = new EventSource("state");
stream.onmessage = (message) => show(JSON.parse(message.data));
stream.onerror = () => say("spin-usd watch has ended, or cannot be reached; start it again", true);

function show(latest) {
  state = latest;
  showPictures();
  element("name").textContent = state.frame ? `${state.frame} of ${state.variant}` : "spin-usd watch";
  document.title = state.frame ? `${state.frame} · spin-usd watch` : "spin-usd watch";
  element("frames").textContent = state.frames ? `of 0 to ${state.frames - 1}` : "";
  element("light").textContent = state.light ? light() : "";
  element("status").textContent = status();
  say(state.message, state.status === "faulty");
  document.body.classList.toggle("stale", state.status === "faulty");
  showChoice();
  element("notes").replaceChildren(...state.notes.map((note) => item(note)));
}

function showPictures() {
  for (const [kind, version] of Object.entries(state.pictures)) {
    const picture = element(kind), source = `picture/${kind}?${version}`;
    if (picture && picture.getAttribute("src") !== source) picture.src = source;
  }
}

function light() {
  const by = LIGHTS[state.light] ?? state.light;
  return state.rendering ? `${by}; Blender is at work on its own …` : by;
}

function status() {
  if (state.status === "reading") return "reading …";
  return state.status === "shown" ? `in ${state.seconds.toFixed(2)} s` : "the last good picture";
}

function say(text, isFault) {
  element("fault").textContent = text;
  element("fault").hidden = !isFault;
}

function showChoice() {
  if (state.status !== "shown") return;
  const variant = element("variant");
  if (variant.options.length !== state.variants.length || state.variants.some((name, i) => variant.options[i].value !== name)) {
    variant.replaceChildren(...state.variants.map((name) => new Option(name, name)));
  }
  variant.value = state.variant;
  element("place").max = Math.max(state.frames - 1, 0);
  if (document.activeElement !== element("place")) element("place").value = state.place;
}

function item(text) {
  const line = document.createElement("li");
  line.textContent = text;
  return line;
}

function choose(place) {
  if (!state || !state.frames) return;
  const inside = Math.min(Math.max(Number(place) || 0, 0), state.frames - 1);
  element("place").value = inside;
  const choice = { frame: String(inside), variant: element("variant").value || state.variant };
  fetch("choice", { method: "POST", body: JSON.stringify(choice) });
}

const step = (by) => choose(Number(element("place").value) + by);
element("before").onclick = () => step(-1);
element("after").onclick = () => step(1);
element("place").onchange = () => choose(element("place").value);
element("variant").onchange = () => choose(element("place").value);
element("choice").onsubmit = (event) => event.preventDefault();
document.addEventListener("keydown", (event) => {
  if (["INPUT", "SELECT"].includes(document.activeElement?.tagName)) return;
  if (event.key === "ArrowLeft") step(-1);
  if (event.key === "ArrowRight") step(1);
});
