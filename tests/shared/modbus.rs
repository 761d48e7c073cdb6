//! What the devices of the tests say by Modbus TCP, written without the project's own reader.

use std::io::{self, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;

/// The head of a request, which its answer begins with.
pub(crate) struct Head([u8; 7]);

/// The next request of a connection: its head, and its function with what follows.
pub(crate) fn request(connection: &mut TcpStream) -> io::Result<(Head, Vec<u8>)> {
    let mut head = [0; 7];
    connection.read_exact(&mut head)?;
    let length = usize::from(u16::from_be_bytes([head[4], head[5]]));
    let mut request = vec![0; length.saturating_sub(1)];
    connection.read_exact(&mut request)?;
    Ok((Head(head), request))
}

/// A device on a free port, whose number it is: each connection is served in a thread of its own until its client ends it.
pub(crate) fn serve(answer: impl Fn(&[u8]) -> Vec<u8> + Send + Sync + 'static) -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let port = listener.local_addr().expect("bound").port();
    let answer = Arc::new(answer);
    std::thread::spawn(move || {
        for mut connection in listener.incoming().flatten() {
            let answer = Arc::clone(&answer);
            std::thread::spawn(move || -> io::Result<()> {
                connection.set_nodelay(true)?;
                loop {
                    let (head, asked) = request(&mut connection)?;
                    head.answer(&mut connection, &answer(&asked))?;
                }
            });
        }
    });
    port
}

impl Head {
    /// Sends the answer: the function and what follows.
    pub(crate) fn answer(mut self, connection: &mut TcpStream, answer: &[u8]) -> io::Result<()> {
        let length = u16::try_from(answer.len() + 1).expect("short");
        self.0[4..6].copy_from_slice(&length.to_be_bytes());
        connection.write_all(&[&self.0[..], answer].concat())
    }
}
