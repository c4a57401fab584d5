// What the live room needs of a browser and a network; each says what is so, and what to do if not.

const ANSWER_MS = 4000;

/** Each as { name, look: async () => ({ isFine, isNeeded, words, remedy, link }) }; a link is
    [address, words] or missing. */
export const BLOCKS = [
  { name: "Secure address", look: secure },
  { name: "Certificate", look: certificate },
  { name: "3D graphics (WebGL 2)", look: graphics },
  { name: "Connection (WebSocket)", look: socket },
  { name: "VR headset (WebXR)", look: () => headset("immersive-vr", "A headset is there.") },
  { name: "AR over the real room (WebXR)",
    look: () => headset("immersive-ar", "This headset shows the real room.") },
];

const fine = (words) => ({ isFine: true, isNeeded: true, words, remedy: "" });
const blocked = (words, remedy) => ({ isFine: false, isNeeded: true, words, remedy });
const without = (words, remedy) => ({ isFine: false, isNeeded: false, words, remedy });

function secure() {
  if (window.isSecureContext) return fine("Yes.");
  return without("No: this address begins with http. The room works, a headset does not.",
    "Open the address of the invitation, which begins with https, or join on the studio's own computer.");
}

async function certificate() {
  if (location.protocol !== "https:") {
    return fine("None is needed on this address.");
  }
  try {
    await fetch("/check", { cache: "no-store" });
    return { ...fine("This device accepts the studio's certificate, or a warning about it was passed."),
      link: ["/root.crt", "The studio's root certificate, to install"] };
  } catch {
    return blocked("This device does not accept the studio's certificate.",
      "Install the studio's root certificate on this device, or accept the warning, then load again.");
  }
}

/** Whether the browser draws in three dimensions. */
export function graphics() {
  const context = document.createElement("canvas").getContext("webgl2");
  if (!context) {
    return blocked("This browser gives the page no 3D graphics.",
      "Switch hardware acceleration on in its settings, or use another browser.");
  }
  const info = context.getExtension("WEBGL_debug_renderer_info");
  const card = info ? context.getParameter(info.UNMASKED_RENDERER_WEBGL) : "";
  context.getExtension("WEBGL_lose_context")?.loseContext();
  if (/swiftshader|llvmpipe|software/i.test(card)) {
    return fine("Yes, but without a graphics card: the picture is slow. Switch hardware acceleration on.");
  }
  return fine("Yes.");
}

function socket() {
  return new Promise((answer) => {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const probe = new WebSocket(`${scheme}://${location.host}/people`);
    const end = (result) => { clearTimeout(late); probe.close(); answer(result); };
    const remedy = "Is the studio running? A firewall, VPN or proxy between may stop it: try without.";
    const late = setTimeout(() => end(blocked("The studio does not answer.", remedy)), ANSWER_MS);
    probe.addEventListener("open", () => end(fine("The studio answers.")));
    probe.addEventListener("error", () => end(blocked("It does not open.", remedy)));
  });
}

async function headset(mode, found) {
  if (!window.isSecureContext) {
    return without("Not on an address without https.", "See the first point.");
  }
  const works = await navigator.xr?.isSessionSupported(mode).catch(() => false);
  if (works) return fine(found);
  if (mode === "immersive-ar") {
    return without("This browser cannot show the real room behind the page.",
      "In a Quest 3, open this page in the headset's own browser.");
  }
  return without("This browser finds no headset. The room works on the screen.",
    "In a Quest, open this page in the headset's own browser.");
}
