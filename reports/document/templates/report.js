// Without this script the page is complete. With it, the pictures of a row open in one place, one
// over the other: what moves when they flip is what differs.
(() => {
  if (!window.HTMLDialogElement) return;
  const dialog = document.createElement("dialog");
  dialog.setAttribute("aria-label", "Pictures, one over the other");
  const row = document.createElement("div");
  const stage = document.createElement("div");
  row.className = "row";
  dialog.append(row, stage);
  document.body.append(dialog);
  let panels = [];
  let shown = 0;

  const button = (text, action) => {
    const b = document.createElement("button");
    b.type = "button";
    b.textContent = text;
    b.addEventListener("click", action);
    return b;
  };
  const show = (index) => {
    shown = (index + panels.length) % panels.length;
    const img = panels[shown].querySelector("img").cloneNode();
    const bar = panels[shown].querySelector(".scale-bar");
    img.addEventListener("click", () => show(shown + 1));
    stage.replaceChildren(img, ...(bar ? [bar.cloneNode(true)] : []));
    [...row.children].forEach((b, i) => {
      if (i < panels.length) b.setAttribute("aria-pressed", String(i === shown));
    });
  };
  const open = (figure, index) => {
    panels = [...figure.querySelectorAll(".panel")];
    const names = panels.map((p) => p.querySelector(".figure-title").textContent);
    const close = button("Close", () => dialog.close());
    close.className = "close";
    row.replaceChildren(...names.map((name, i) => button(name, () => show(i))), close);
    dialog.showModal();
    show(index);
  };
  dialog.addEventListener("keydown", (event) => {
    if (event.key === "ArrowRight") show(shown + 1);
    else if (event.key === "ArrowLeft") show(shown - 1);
    else return;
    event.preventDefault();
  });
  for (const figure of document.querySelectorAll(".pictures")) {
    figure.querySelectorAll("img").forEach((img, i) => {
      img.classList.add("opens");
      img.addEventListener("click", () => open(figure, i));
    });
    if (figure.querySelectorAll(".panel").length < 2) continue;
    const flip = button("Flip between the pictures", () => open(figure, 0));
    flip.classList.add("flip");
    figure.prepend(flip);
  }
})();
