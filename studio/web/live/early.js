// For browsers too old for the page's modules; they read no more than this.
"use strict";
if (!(HTMLScriptElement.supports && HTMLScriptElement.supports("module"))) {
  document.getElementById("message-words").textContent =
    "This browser is too old for the room. Use Chrome or Edge 103, Firefox 104, Safari 16 or newer.";
}
