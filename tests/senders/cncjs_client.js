// A client of cncjs, by the socket.io that comes with it.
//
// node cncjs_client.js FOLDER ADDRESS TOKEN: each line of stdin is a list of JSON, an event to the
// server; each line of stdout is one that has come. The server also says when it has opened or closed
// a port: "done:" and the event, and an error or null. Closing takes it some time, after which it
// would forget the port if that were opened again meanwhile.
const DONE = new Set(['open', 'close']);
const [folder, address, token] = process.argv.slice(2);
const client = require(require.resolve('socket.io-client', {paths: [folder]}));
const socket = client(address, {query: `token=${token}`});
const taken = socket.onevent;
socket.onevent = (packet) => {
  console.log(JSON.stringify(packet.data));
  taken.call(socket, packet);
};
socket.on('connect', () => console.log('["connect"]'));
require('readline').createInterface({input: process.stdin})
  .on('line', (line) => {
    const event = JSON.parse(line);
    if (DONE.has(event[0])) {
      event.push((error) => console.log(JSON.stringify([`done:${event[0]}`, error])));
    }
    socket.emit(...event);
  })
  .on('close', () => process.exit());
