// The page's own start: unpacks the parts it carries and gives them to the browser as modules.
"use strict";
(() => {
  const message = document.getElementById("message");
  const show = (text) => { message.hidden = false; message.textContent = text; };
  window.addEventListener("error", (event) => show(`The viewer stopped: ${event.message}`));
  window.addEventListener("unhandledrejection", (event) =>
    show(`The viewer stopped: ${event.reason?.message ?? event.reason}`));

  const canUnpack = typeof DecompressionStream === "function";
  const hasMaps = HTMLScriptElement.supports?.("importmap");
  if (!canUnpack || !hasMaps) {
    show("This browser is too old for the viewer.\n" +
      "Open this file with Chrome or Edge 103, Firefox 113, Safari 16.4 or newer.");
    return;
  }
  if (!document.createElement("canvas").getContext("webgl2")) {
    show("This browser gives the page no 3D graphics (WebGL 2).\n" +
      "Switch hardware acceleration on in its settings, or open this file with another browser.");
    return;
  }

  // A part's bytes; its text leaves the page, so that memory holds it once.
  const partBytes = (name) => {
    const element = document.getElementById(`part:${name}`);
    const packed = atob(element.textContent);
    element.remove();
    const bytes = new Uint8Array(packed.length);
    for (let i = 0; i < packed.length; i++) bytes[i] = packed.charCodeAt(i);
    return bytes;
  };
  const unpacked = (name) => {
    const stream = new Blob([partBytes(name)]).stream();
    return new Response(stream.pipeThrough(new DecompressionStream("gzip")));
  };
  const partText = (name) => unpacked(name).text();
  const hasPart = (name) => document.getElementById(`part:${name}`) !== null;
  const partBuffer = (name) => unpacked(name).arrayBuffer();
  window.viewerParts = { bytes: partBytes, text: partText, buffer: partBuffer, has: hasPart };

  // The page's own face: nothing is fetched, and words look the same on every machine.
  const loadFonts = async () => {
    for (const weight of ["400", "700"]) {
      const bytes = await unpacked(`font-${weight}`).arrayBuffer();
      document.fonts.add(await new FontFace("Atkinson Hyperlegible Next", bytes, { weight }).load());
    }
  };

  const open = async () => {
    await loadFonts();
    const imports = {};
    const modules = document.querySelectorAll("script[data-module]");
    for (const element of /** @type {NodeListOf<HTMLScriptElement>} */ (modules)) {
      const name = element.dataset.module;
      const source = new Blob([await partText(element.id.slice(5))], { type: "text/javascript" });
      imports[name] = URL.createObjectURL(source);
    }
    const map = document.createElement("script");
    map.type = "importmap";
    map.textContent = JSON.stringify({ imports });
    document.head.append(map);
    await import("viewer/main.js");
  };
  open().catch((error) => show(`The viewer could not start: ${error.message}`));
})();
