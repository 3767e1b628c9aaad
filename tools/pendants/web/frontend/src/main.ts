import "./style.css";

const page = document.getElementById("page");
if (page !== null) page.textContent = "openpendant";
