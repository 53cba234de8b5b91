// A client of cncjs, by the socket.io that comes with it.
//
// node cncjs_client.js FOLDER ADDRESS TOKEN: each line of stdin is a list of JSON, an event to the
// server; each line of stdout is one that has come.
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
  .on('line', (line) => socket.emit(...JSON.parse(line)))
  .on('close', () => process.exit());
