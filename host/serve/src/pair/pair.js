// Pairs this browser by the code in the address, behind #, which no browser sends or writes into a log, or by one that is typed.
"use strict";

const form = document.querySelector("form");
const said = document.querySelector("[role=status]");

async function pair(code) {
    try {
        const answer = await fetch("/pair", { method: "POST", body: code });
        if (!answer.ok) said.textContent = await answer.text();
        // So that the code does not stay in the address.
        else if ((await fetch("/machines")).ok) location.replace("/?served#work");
        else said.textContent = "This browser keeps no cookies. Allow them for this address, or use another browser.";
    } catch {
        said.textContent = "The computer does not answer: see that this phone is in its network, and try again.";
    }
}

form.addEventListener("submit", (event) => {
    event.preventDefault();
    void pair(form.elements.code.value);
});

const code = location.hash.slice(1);
// The page's own views stand there too.
if (/\d|[A-Z]{8}/.test(code)) void pair(code);
