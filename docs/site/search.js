// Search on pages that were opened from a folder (file://). There a browser neither fetches the index nor starts a worker: the index comes
// as a script, and the worker's script runs in a hidden frame.
if (location.protocol === "file:") {
  const source = new URL(document.currentScript.dataset.index, location.href)
  const index = new Promise(resolve => {
    const script = document.createElement("script")
    script.src = source
    script.onload = () => resolve(window.ordoSearchIndex)
    document.head.append(script)
  })
  window.__search = {index}

  window.Worker = class extends EventTarget {
    constructor(url) {
      super()
      const frame = document.createElement("iframe")
      frame.hidden = true
      frame.receive = data => this.dispatchEvent(new MessageEvent("message", {data}))
      const end = "</" + "script>"
      frame.srcdoc = `<script>postMessage = data => frameElement.receive(data)${end}<script src="${new URL(url, location.href)}">${end}`
      this.frame = new Promise(resolve => { frame.onload = () => resolve(frame.contentWindow) })
      document.body.append(frame)
    }
    postMessage(data) {
      this.frame.then(frame => frame.dispatchEvent(new MessageEvent("message", {data})))
    }
  }
}
