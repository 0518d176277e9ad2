// The page of `spin-usd watch`: it shows the news that the server sends, and sends back what is to be shown.

const LIGHTS = { raycast: "preview (raycast)", blender: "Blender" };
const element = (id) => document.getElementById(id);
let news = null;

const stream = new EventSource("news");
stream.onmessage = (message) => show(JSON.parse(message.data));
stream.onerror = () => say("spin-usd watch has ended, or cannot be reached; start it again", true);

function show(latest) {
  news = latest;
  showPictures();
  element("name").textContent = news.frame ? `${news.frame} of ${news.variant}` : "spin-usd watch";
  document.title = news.frame ? `${news.frame} · spin-usd watch` : "spin-usd watch";
  element("frames").textContent = news.frames ? `of 0 to ${news.frames - 1}` : "";
  element("light").textContent = news.light ? light() : "";
  element("status").textContent = status();
  say(news.message, news.status === "faulty");
  document.body.classList.toggle("stale", news.status === "faulty");
  showChoice();
  element("notes").replaceChildren(...news.notes.map((note) => item(note)));
}

function showPictures() {
  for (const [kind, version] of Object.entries(news.pictures)) {
    const picture = element(kind), source = `picture/${kind}?${version}`;
    if (picture && picture.getAttribute("src") !== source) picture.src = source;
  }
}

function light() {
  const by = LIGHTS[news.light] ?? news.light;
  return news.rendering ? `${by}; Blender is at work on its own …` : by;
}

function status() {
  if (news.status === "reading") return "reading …";
  return news.status === "shown" ? `in ${news.seconds.toFixed(2)} s` : "the last good picture";
}

function say(text, isFault) {
  element("fault").textContent = text;
  element("fault").hidden = !isFault;
}

function showChoice() {
  if (news.status !== "shown") return;
  const variant = element("variant");
  if (variant.options.length !== news.variants.length || news.variants.some((name, i) => variant.options[i].value !== name)) {
    variant.replaceChildren(...news.variants.map((name) => new Option(name, name)));
  }
  variant.value = news.variant;
  element("place").max = Math.max(news.frames - 1, 0);
  if (document.activeElement !== element("place")) element("place").value = news.place;
}

function item(text) {
  const line = document.createElement("li");
  line.textContent = text;
  return line;
}

function choose(place) {
  if (!news || !news.frames) return;
  const inside = Math.min(Math.max(Number(place) || 0, 0), news.frames - 1);
  element("place").value = inside;
  const choice = { frame: String(inside), variant: element("variant").value || news.variant };
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
